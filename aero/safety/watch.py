"""Watching a hand: `Watch` makes violations of readings, `Lookout` reads when it is time, and tells how late it was."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel
from aero.clock import Clock
from aero.driver import AeroHand
from aero.errors import AeroError
from aero.protocol import MAX_CODE
from aero.safety.encoders import Debounce, Encoders, Reading
from aero.safety.stop import SafetyReason, Violation
from aero.safety.thresholds import Thresholds

_LOG = logging.getLogger(__name__)
Floats = NDArray[np.float64]
ROUNDING_S = 1e-6
"""A poll that waits for exactly as long as a board may be silent says so at once, and not after another one."""
WORTH_SAYING_S = 0.03
"""Delays below this are those of an idle machine and a healthy board, s."""


class Watch:
    """Judges what a hand reports against what it was commanded. It knows no hand and no clock.

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


LATE = {
    "poll": "this machine was busy or the program did not call: polls began up to {:.2f} s late",
    "reply": "readings came up to {:.2f} s after they were asked for, because of this machine, the link or the board",
}
"""What may be late, and what is said of the worst. Nothing tells who held a reply up, and no reply at all is nobody's
lateness."""


class Lateness:
    """Remembers the delays of the last `kept_s` (s): polls that began late, and replies that came late."""

    def __init__(self, kept_s: float, piece_s: float) -> None:
        """Keep delays for `kept_s`; an idle program waits in pieces of `piece_s`, so its polls begin that late (s)."""
        self._kept_s = kept_s
        self._piece_s = piece_s
        self._delays: deque[tuple[float, str, float]] = deque()

    def began(self, t: float, late_s: float) -> bool:
        """Take a poll that began at `t`, `late_s` after it was due (s); return whether that is worth saying."""
        late = late_s > self._piece_s + WORTH_SAYING_S
        self._note(t, "poll", late_s if late else 0.0)
        return late

    def answered(self, t: float, after_s: float) -> None:
        """Take a poll that was answered at `t`, `after_s` after it began (s)."""
        self._note(t, "reply", after_s)

    def _note(self, t: float, what: str, late_s: float) -> None:
        if late_s > WORTH_SAYING_S:
            self._delays.append((t, what, late_s))
        while self._delays and self._delays[0][0] < t - self._kept_s:
            self._delays.popleft()

    def remark(self) -> str:
        """Return what to say about it, empty when all was in time."""
        worst = {what: max((s for _, one, s in self._delays if one == what), default=0.0) for what in LATE}
        said = "; ".join(LATE[what].format(late_s) for what, late_s in worst.items() if late_s)
        return f". In the {self._kept_s:g} s before, {said}" if said else ""


class Stop(NamedTuple):
    """What a poll found that stops the hand."""

    violation: Violation
    silent: bool
    """Whether the board left the poll unanswered."""


class Lookout:
    """Reads positions, currents and temperatures when it is time, and lets `Watch` judge them."""

    def __init__(
        self, hand: AeroHand, clock: Clock, thresholds: Thresholds, spans_counts: ArrayLike, telemetry_s: float
    ) -> None:
        """Be due at once.

        Args:
            hand: what is polled.
            clock: of the hand.
            thresholds: when to poll, and what the hand must not exceed.
            spans_counts: (7,) servo counts of the channels' windows.
            telemetry_s: age that a value may have when the board sends it, s.
        """
        self.watch = Watch(thresholds, spans_counts, telemetry_s)
        self._hand = hand
        self._clock = clock
        self._thresholds = thresholds
        self._lateness = Lateness(thresholds.follow_s, thresholds.look_s)
        self._due = self._temperatures_due = self._looked_at = clock.now()

    def pause(self) -> None:
        """Expect nothing of what was before: the hand has homed and answered nothing meanwhile."""
        self.watch.pause()
        self._due = self._looked_at = self._clock.now()

    @property
    def unwatched_s(self) -> float:
        """Time since the last poll, s."""
        return self._clock.now() - self._looked_at

    def remark(self) -> str:
        """Return what to say about late polls and late replies, empty when all was in time."""
        return self._lateness.remark()

    def look(self, *, closed: bool, restore: Callable[[], None]) -> Stop | None:
        """Poll if it is time, and return what stops the hand, or None.

        Args:
            closed: whether the hand may be closed, so that it must not go unwatched.
            restore: called after a poll that was answered; an error of it counts as no answer.

        Raises:
            ConnectionError: the link is gone.
        """
        now = self._clock.now()
        if now < self._due:
            return None
        silent = False
        if self._hand.silent_from is None:  # else the program has waited for the board
            # What the poll before took makes this one not late.
            late_s = now - max(self._due, self._looked_at + self._thresholds.look_s)
            if self._lateness.began(now, late_s):
                _LOG.info("%s: guard poll %.2f s late", self._hand.name, late_s)
        try:
            violation = self._unwatched(now, closed) or self._read()
            self._lateness.answered(self._clock.now(), self._clock.now() - now)
            restore()
        except AeroError as error:
            _LOG.info("%s: a poll was not answered: %s", self._hand.name, error)
            # What the program itself has asked in vain counts too.
            asked = now if self._hand.silent_from is None else min(now, self._hand.silent_from)
            violation = self.watch.unanswered(asked, self._clock.now())
            silent = True
        self._looked_at = self._clock.now()
        self._due = now + self._thresholds.look_s
        return None if violation is None else Stop(violation, silent)

    def _unwatched(self, now: float, closed: bool) -> Violation | None:
        """Return the violation when nobody has polled a hand that is not open for too long."""
        unwatched_s = now - self._looked_at
        if not closed or unwatched_s <= self._thresholds.unwatched_s:
            return None
        return Violation(
            SafetyReason.UNWATCHED,
            f"nobody has polled the hand for {unwatched_s:.0f} s (limit {self._thresholds.unwatched_s:g} s): this "
            "machine was suspended, or the program was stopped or did not call; wait on the hand's clock",
        )

    def _read(self) -> Violation | None:
        asked, codes = self._clock.now(), self._hand.read_codes()
        reading = Reading(asked, self._clock.now(), codes / MAX_CODE)
        violation = self.watch.look(reading, self._hand.read_currents())
        if violation is None and reading.replied >= self._temperatures_due:
            self._temperatures_due = reading.replied + self._thresholds.temperature_look_s
            violation = self.watch.temperatures(self._hand.read_temperatures())
        return violation
