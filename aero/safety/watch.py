"""Watching a hand: from readings to a reason to stop. Pure: no hand, no clock, no output."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Iterator

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.safety.thresholds import Thresholds

Floats = NDArray[np.float64]


class Watch:
    """Judges what a hand reports against what it was told.

    Positions and commands are shares of the command window, (7,) in command order, 0 open and 1 closed; times are s on
    any one clock and never run backwards.
    """

    def __init__(self, thresholds: Thresholds) -> None:
        self._thresholds = thresholds
        self._since: dict[Hashable, float] = {}
        self._commands: deque[tuple[float, Floats]] = deque()
        self._last_reading = b""
        self._answered_at: float | None = None

    def commanded(self, t: float, shares: Floats) -> None:
        """Take a position command; the first one after `forget_commands` may find the encoders anywhere."""
        if not self._commands:
            self._commands.extend((t, np.full(len(Channel), end)) for end in (0.0, 1.0))
        self._commands.append((t, shares.copy()))

    def found(self, t: float, shares: Floats) -> None:
        """Take positions that the hand is known to be at rest in, in place of all earlier commands."""
        self._commands.clear()
        self._commands.append((t, shares.copy()))

    def forget_commands(self) -> None:
        """Expect encoders anywhere until the next command: the hand homes, or is driven by torque."""
        self._commands.clear()
        self._since.clear()
        self._answered_at = None

    def unanswered(self, t: float) -> str | None:
        """Return why to stop when a reading was asked for in vain, None to go on."""
        if self._answered_at is None:
            self._answered_at = t
        age = t - self._answered_at
        if age <= self._thresholds.stale_s:
            return None
        return (
            f"the hand has not answered for {age:.2f} s (limit {self._thresholds.stale_s:g} s): check its supply and "
            "its USB cable"
        )

    def temperatures(self, celsius: Floats) -> str | None:
        """Return why to stop after a look at the temperatures (7,) °C, None to go on."""
        hottest = int(np.argmax(celsius))
        if celsius[hottest] < self._thresholds.temperature_c:
            return None
        return (
            f"{Channel(hottest).label} is at {celsius[hottest]:.0f} °C (limit {self._thresholds.temperature_c:.0f} "
            "°C): let the hand cool, and look for a cable that is too tight or a motion that holds against a stop"
        )

    def look(self, t: float, positions: Floats, currents_a: Floats) -> str | None:
        """Return why to stop after a look at positions (7,) and currents (7,) A, taken together; None to go on."""
        self._answered_at = t
        return next(self._objections(t, positions, currents_a), None)

    def _objections(self, t: float, positions: Floats, currents_a: Floats) -> Iterator[str]:
        yield from self._over_current(t, currents_a)
        yield from self._repeated(t, positions.tobytes() + currents_a.tobytes())
        yield from self._strayed(t, positions)

    def _over_current(self, t: float, currents_a: Floats) -> Iterator[str]:
        limit_a, limit_s = self._thresholds.current_a, self._thresholds.current_s
        for channel in Channel:
            drawn = abs(currents_a[channel])
            if self._lasts(("current", channel), drawn > limit_a, t) >= limit_s:
                yield (
                    f"{channel.label} has drawn more than {limit_a:g} A for {limit_s:g} s, now {drawn:.1f} A: look "
                    "for what blocks it"
                )

    def _repeated(self, t: float, reading: bytes) -> Iterator[str]:
        same, self._last_reading = reading == self._last_reading, reading
        if self._lasts("repeated", same, t) > self._thresholds.stale_s:
            yield (
                f"positions and currents have repeated to the last digit for {self._thresholds.stale_s:g} "
                "s: the board no longer reaches all its servos; check the servo cables and the servos' supply"
            )

    def _strayed(self, t: float, positions: Floats) -> Iterator[str]:
        while len(self._commands) > 1 and self._commands[1][0] < t - self._thresholds.follow_s:
            self._commands.popleft()
        if not self._commands:
            return
        recent = np.array([shares for _, shares in self._commands])
        lowest, highest = recent.min(axis=0), recent.max(axis=0)
        for channel in Channel:
            at = positions[channel]
            short = lowest[channel] - at > self._thresholds.short
            beyond = at - highest[channel] > self._thresholds.beyond
            if self._lasts(("stray", channel), short or beyond, t) < self._thresholds.stray_s:
                continue
            asked = f"{lowest[channel]:.0%}"
            if highest[channel] > lowest[channel]:
                asked += f" to {highest[channel]:.0%}"
            yield (
                f"{channel.label} stands at {at:.0%} of its window, and was only sent to {asked} in the last "
                f"{self._thresholds.follow_s:g} s: it is blocked or without torque, its servo has another ID, its zero "
                "is lost, or it turns the wrong way; home the hand and try one channel at a time"
            )

    def _lasts(self, what: Hashable, true: bool, t: float) -> float:
        """Return for how long something has been true, s; -1 when it is not."""
        if not true:
            self._since.pop(what, None)
            return -1.0
        return t - self._since.setdefault(what, t)
