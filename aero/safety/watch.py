"""Watching a hand: from readings to violations of the thresholds. Pure: no hand, no clock, no output."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel
from aero.safety.encoders import Debounce, Encoders, Reading
from aero.safety.stop import SafetyReason, Violation
from aero.safety.thresholds import Thresholds

Floats = NDArray[np.float64]


ROUNDING_S = 1e-6
"""A poll that waits for exactly as long as a board may be silent says so at once, and not after another one."""


class Watch:
    """Judges what a hand reports against what it was commanded.

    Positions are fractions of the command window, (7,) in command order, 0 open and 1 closed; times are s on any one
    clock and never run backwards.
    """

    def __init__(self, thresholds: Thresholds, spans_counts: ArrayLike, telemetry_s: float) -> None:
        """Start watching.

        Args:
            thresholds: what the hand must not exceed.
            spans_counts: (7,) servo counts of the channels' command windows.
            telemetry_s: age that a value may have when the board sends it, s.
        """
        self.encoders = Encoders(thresholds, spans_counts, telemetry_s)
        """What it knows of commands; tell it each one."""
        self._thresholds = thresholds
        self._debounce = Debounce(2 * thresholds.look_s)
        self._last_reading = b""
        self._silent_from: float | None = None

    def pause(self) -> None:
        """Expect nothing for a while: the hand homes and answers nothing."""
        self.encoders.forget()
        self._debounce.clear()
        self._silent_from = None

    def unanswered(self, asked: float, t: float) -> Violation | None:
        """Return the violation when a reading was asked for in vain from `asked` to `t` (s), or None."""
        if self._silent_from is None:
            self._silent_from = asked
        silent_s = t - self._silent_from
        if silent_s < self._thresholds.silent_s - ROUNDING_S:
            return None
        return Violation(
            SafetyReason.SILENT,
            f"the hand has not answered for {silent_s:.2f} s (limit {self._thresholds.silent_s:g} s): check its supply "
            "and its USB cable",
        )

    def temperatures(self, celsius: Floats) -> Violation | None:
        """Return the violation that temperatures (7,) °C show, or None."""
        hottest = int(np.argmax(celsius))
        if celsius[hottest] < self._thresholds.temperature_c:
            return None
        channel = Channel(hottest)
        return Violation(
            SafetyReason.TEMPERATURE,
            f"{channel.label} is at {celsius[hottest]:.0f} °C (limit {self._thresholds.temperature_c:.0f} "
            "°C): let the hand cool, and look for a cable that is too tight or a motion that holds against a stop",
            channel,
        )

    def look(self, reading: Reading, currents_a: Floats) -> Violation | None:
        """Return the violation that positions and currents (7,) A, read together, show; or None."""
        self._silent_from = None
        return next(self._violations(reading, currents_a), None)

    def _violations(self, reading: Reading, currents_a: Floats) -> Iterator[Violation]:
        yield from self._over_current(reading.replied, currents_a)
        yield from self._repeated(reading.replied, reading.positions.tobytes() + currents_a.tobytes())
        yield from self.encoders.violations(reading)

    def _over_current(self, t: float, currents_a: Floats) -> Iterator[Violation]:
        limit_a, limit_s = self._thresholds.current_a, self._thresholds.current_s
        for channel in Channel:
            drawn = abs(currents_a[channel])
            if self._debounce.seconds(("current", channel), drawn > limit_a, t) >= limit_s:
                yield Violation(
                    SafetyReason.CURRENT,
                    f"{channel.label} has drawn more than {limit_a:g} A for {limit_s:g} s, now {drawn:.1f} A: look "
                    "for what blocks it",
                    channel,
                )

    def _repeated(self, t: float, reading: bytes) -> Iterator[Violation]:
        same, self._last_reading = reading == self._last_reading, reading
        if self._debounce.seconds("repeated", same, t) > self._thresholds.stale_s:
            yield Violation(
                SafetyReason.STALE,
                f"positions and currents have repeated to the last digit for {self._thresholds.stale_s:g} "
                "s: the board no longer reaches all its servos; check the servo cables and the servos' supply",
            )
