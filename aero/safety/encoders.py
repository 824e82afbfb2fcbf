"""Encoder checks against commands: admissible range, largest speed, no motion at rest."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Hashable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel
from aero.floats import Floats
from aero.safety.stop import SafetyReason, Violation
from aero.safety.thresholds import Thresholds


class Debounce:
    """Durations for which several conditions have held.

    The time between two polls counts only up to `most_gap_s` (s), because a condition before and after a pause of the
    program need not have held meanwhile.
    """

    def __init__(self, most_gap_s: float) -> None:
        self._most_gap_s = most_gap_s
        self._seen: dict[Hashable, tuple[float, float]] = {}

    def seconds(self, what: Hashable, holds: bool, t: float) -> float:
        """Return the duration, s, for which `what` has held at `t` (s), 0 at its first poll; -1 if it does not hold."""
        if not holds:
            self._seen.pop(what, None)
            return -1.0
        before, held = self._seen.get(what, (t, 0.0))
        held += min(t - before, self._most_gap_s)
        self._seen[what] = t, held
        return held

    def clear(self) -> None:
        """Restart every duration."""
        self._seen.clear()


@dataclass(frozen=True)
class Reading:
    """Positions, (7,) fractions of the command window in command order, with the times of their exchange."""

    asked: float
    """Time just before the request, clock s."""
    replied: float
    """Time just after the reply, clock s."""
    positions: NDArray[np.float64]

    def longest_s(self, earlier: Reading, telemetry_s: float) -> float:
        """Return the longest possible time between two samples, s, for values up to `telemetry_s` old when sent.

        The earlier sample is at most `telemetry_s` older than its request, the later one no newer than its reply.
        """
        return self.replied - earlier.asked + telemetry_s


class Encoders:
    """Check of positions against the commands of the last `Thresholds.follow_s`.

    Positions and commands are fractions of the command window, (7,) in command order, 0 open and 1 closed.
    """

    def __init__(self, thresholds: Thresholds, spans_counts: ArrayLike, telemetry_s: float) -> None:
        """Accept any position until `follow_s` after the first command.

        Args:
            thresholds: stop criteria.
            spans_counts: (7,) servo counts of the channels' windows.
            telemetry_s: largest age of a value when the board sends it, s.
        """
        self._thresholds = thresholds
        self._telemetry_s = telemetry_s
        self._spans = np.array(spans_counts, float)  # a copy: the caller may modify its array
        if self._spans.shape != (len(Channel),):
            raise ValueError(f"spans_counts needs {len(Channel)} numbers, one a channel, got shape {self._spans.shape}")
        if not (np.isfinite(self._spans) & (self._spans > 0)).all():
            raise ValueError(f"spans_counts: expected positive counts, got {self._spans.tolist()}")
        self._debounce = Debounce(2 * thresholds.look_s)
        self._commands: deque[tuple[float, Floats]] = deque()
        self._known_from = math.inf
        self._believed: Reading | None = None
        self._suspect: tuple[Reading, Violation] | None = None
        self._rest: Floats | None = None

    def commanded(self, t: float, shares: Floats) -> None:
        """Record a position command sent at `t` (s)."""
        if math.isinf(self._known_from):
            self._known_from = t + self._thresholds.follow_s
        if not self._commands or not np.array_equal(self._commands[-1][1], shares):
            self._commands.append((t, shares.copy()))

    def found(self, t: float, shares: Floats) -> None:
        """Replace all earlier commands by positions in which the hand is known to rest."""
        self.forget()
        self._known_from = t
        self._commands.append((t, shares.copy()))

    def forget(self) -> None:
        """Accept any position until `follow_s` after the next command, as for homing or torque mode."""
        self._known_from = math.inf
        self._commands.clear()
        self._debounce.clear()
        self._believed = self._suspect = self._rest = None

    def violations(self, reading: Reading) -> Iterator[Violation]:
        """Yield the violations in a reading."""
        sampled = reading.asked - self._telemetry_s
        if sampled < self._known_from or not self._commands:
            self._believed, self._suspect = reading, None
            return
        yield from self._jumped(reading)
        if self._suspect is not None:
            return  # a suspect reading is not checked further
        while len(self._commands) > 1 and self._commands[1][0] < sampled - self._thresholds.follow_s:
            self._commands.popleft()
        recent = np.array([shares for _, shares in self._commands])
        yield from self._strayed(reading.replied, reading.positions, recent.min(axis=0), recent.max(axis=0))
        resting = len(self._commands) == 1 and self._commands[0][0] < sampled - self._thresholds.follow_s
        yield from self._moved_at_rest(reading.replied, reading.positions, resting)

    def _jumped(self, reading: Reading) -> Iterator[Violation]:
        """Report a jump unless the next reading reverts it, because a single wrong reading is harmless."""
        before, suspect, self._suspect = self._believed, self._suspect, None
        if before is None:
            self._believed = reading
        elif suspect is None:
            jump = self._faster_than_a_servo(before, reading)
            if jump is None:
                self._believed = reading
            else:
                self._suspect = reading, jump
        elif self._faster_than_a_servo(suspect[0], reading) and not self._faster_than_a_servo(before, reading):
            self._believed = reading
        else:
            yield suspect[1]

    def _faster_than_a_servo(self, earlier: Reading, later: Reading) -> Violation | None:
        """Return the violation of a step too fast even over the longest time between its samples, or None."""
        moved = later.positions - earlier.positions
        speeds = np.abs(moved) * self._spans / later.longest_s(earlier, self._telemetry_s)
        fastest = int(np.argmax(speeds))
        if speeds[fastest] <= self._thresholds.jump_counts_s:
            return None
        channel = Channel(fastest)
        return Violation(
            SafetyReason.JUMP,
            f"{channel.label}'s encoder jumped by {moved[fastest]:+.0%} of its window, at "
            f"{speeds[fastest]:.0f} counts/s or more (limit {self._thresholds.jump_counts_s:.0f}): no servo turns "
            "that fast, so its zero is lost or its reading is wrong; home the hand",
            channel,
        )

    def _strayed(self, t: float, positions: Floats, lowest: Floats, highest: Floats) -> Iterator[Violation]:
        for channel in Channel:
            at = positions[channel]
            short = lowest[channel] - at > self._thresholds.short
            beyond = at - highest[channel] > self._thresholds.beyond
            if self._debounce.seconds(channel, short or beyond, t) >= self._thresholds.stray_s:
                asked = f"{lowest[channel]:.0%}"
                if highest[channel] > lowest[channel]:
                    asked += f" to {highest[channel]:.0%}"
                # No remedy moves the hand: this text may stand beside "switch the hand's supply off".
                cause = (
                    "it is blocked or its servo has no torque; look for the obstacle, then inspect the servo"
                    if short
                    else "its motor runs away, its servo has another ID, or its zero is lost; inspect the servo "
                    "before the next command"
                )
                yield Violation(
                    SafetyReason.STRAY,
                    f"{channel.label} stands at {at:.0%} of its window; the commands of the last "
                    f"{self._thresholds.follow_s:g} s were {asked}: {cause}",
                    channel,
                )

    def _moved_at_rest(self, t: float, positions: Floats, resting: bool) -> Iterator[Violation]:
        if not resting or self._rest is None:
            self._rest = positions if resting else None
            return
        moved = positions - self._rest
        most = int(np.argmax(np.abs(moved)))
        away = bool(abs(moved[most]) > self._thresholds.rest)
        if self._debounce.seconds("rest", away, t) >= self._thresholds.stray_s:
            channel = Channel(most)
            yield Violation(
                SafetyReason.MOTION_AT_REST,
                f"{channel.label} moved by {moved[most]:+.0%} of its window without a command (limit "
                f"{self._thresholds.rest:.0%}): another program may be moving the hand, or something pulls at it",
                channel,
            )
