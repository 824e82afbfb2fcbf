"""Polling of a hand: `Lookout` reads on schedule and records delays, `Watch` detects violations in the readings."""

import logging
from collections import deque
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from aero.channels import Channel
from aero.clock import Clock
from aero.driver import AeroHand
from aero.errors import AeroError
from aero.floats import Floats
from aero.protocol import MAX_CODE
from aero.safety.encoders import Debounce, Encoders, Reading
from aero.safety.regions import Gate
from aero.safety.stop import SafetyReason, Violation
from aero.safety.thresholds import Thresholds

_LOG = logging.getLogger(__name__)
ROUNDING_S = 1e-6
"""Tolerance of the comparison with `silent_s`, s, so that a time-out of exactly that length counts."""
WORTH_SAYING_S = 0.03
"""Threshold of a reported delay, s; an idle computer and a healthy board are below it."""


class Watch:
    """Check of readings against thresholds and commands, without access to hand or clock.

    Positions are fractions of the command window, (7,) in command order, 0 open and 1 closed; times are s on one
    monotonic clock.
    """

    def __init__(self, thresholds: Thresholds, spans_counts: ArrayLike, telemetry_s: float) -> None:
        """Start without past commands or readings.

        Args:
            thresholds: stop criteria.
            spans_counts: (7,) servo counts of the channels' command windows.
            telemetry_s: largest age of a value when the board sends it, s.
        """
        self.encoders = Encoders(thresholds, spans_counts, telemetry_s)
        """Encoder checks; the caller reports each command to them."""
        self._thresholds = thresholds
        self._debounce = Debounce(2 * thresholds.look_s)
        self._last_reading = b""
        self._silent_from: float | None = None

    def pause(self) -> None:
        """Drop past commands and readings, as before homing, in which the board is silent."""
        self.encoders.forget()
        self._debounce.clear()
        self._silent_from = None

    def unanswered(self, asked: float, t: float) -> Violation | None:
        """Return the violation for a reading unanswered from `asked` to `t` (s), or None."""
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
        """Return the violation in temperatures (7,) °C, or None."""
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
        """Return the first violation in positions and currents (7,) A of one poll, or None."""
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
                    f"{channel.label} has drawn more than {limit_a:g} A for {limit_s:g} s, now {drawn:.1f} A: "
                    "something blocks it, or its reading is wrong",
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
"""Message about the largest delay, by kind. The cause of a late reply is unknown; a missing reply is not counted."""


class Lateness:
    """Record of late polls and late replies in the last `kept_s` (s)."""

    def __init__(self, kept_s: float, piece_s: float) -> None:
        """Keep delays for `kept_s` (s); `piece_s` (s) is the poll delay of an idle program."""
        self._kept_s = kept_s
        self._piece_s = piece_s
        self._delays: deque[tuple[float, str, float]] = deque()

    def began(self, t: float, late_s: float) -> bool:
        """Record a poll begun at `t`, `late_s` after its due time (s); return whether the delay is reported."""
        late = late_s > self._piece_s + WORTH_SAYING_S
        self._note(t, "poll", late_s if late else 0.0)
        return late

    def answered(self, t: float, after_s: float) -> None:
        """Record a poll answered at `t`, `after_s` after its begin (s)."""
        self._note(t, "reply", after_s)

    def _note(self, t: float, what: str, late_s: float) -> None:
        if late_s > WORTH_SAYING_S:
            self._delays.append((t, what, late_s))
        while self._delays and self._delays[0][0] < t - self._kept_s:
            self._delays.popleft()

    def remark(self) -> str:
        """Return a sentence on the largest recorded delays; empty without any."""
        worst = {what: max((s for _, one, s in self._delays if one == what), default=0.0) for what in LATE}
        said = "; ".join(LATE[what].format(late_s) for what, late_s in worst.items() if late_s)
        return f". In the {self._kept_s:g} s before, {said}" if said else ""


class Stop(NamedTuple):
    """Result of a poll that stops the hand."""

    violation: Violation
    silent: bool
    """True if the board did not answer the poll."""


class Lookout:
    """Scheduled polling of positions, currents and temperatures, checked by `Watch`."""

    def __init__(
        self, hand: AeroHand, clock: Clock, thresholds: Thresholds, spans_counts: ArrayLike, telemetry_s: float
    ) -> None:
        """Schedule the first poll at once.

        Args:
            hand: hand to poll.
            clock: clock of the hand.
            thresholds: poll periods and stop criteria.
            spans_counts: (7,) servo counts of the channels' windows.
            telemetry_s: largest age of a value when the board sends it, s.
        """
        self.watch = Watch(thresholds, spans_counts, telemetry_s)
        self.gate = Gate(thresholds.forbidden)
        """Filter of the commands; polls report the encoders to it."""
        self._hand = hand
        self._clock = clock
        self._thresholds = thresholds
        self._lateness = Lateness(thresholds.follow_s, thresholds.look_s)
        self.due = self._temperatures_due = self._looked_at = clock.now()
        """Time of the next poll, clock s."""
        self.codes = np.zeros(len(Channel), np.int64)
        """Latest positions read, (7,) in 0..65535."""
        self.currents_a: Floats = np.zeros(len(Channel))
        self.celsius: Floats | None = None
        """Latest temperatures read, (7,) °C; None before the first."""
        self.read_at = clock.now()
        """Time of the latest reading, clock s."""

    def pause(self) -> None:
        """Drop past commands and readings and restart the schedule, after homing."""
        self.watch.pause()
        self.gate.forget()
        self.due = self._looked_at = self._clock.now()

    @property
    def unwatched_s(self) -> float:
        """Time since the last poll, s."""
        return self._clock.now() - self._looked_at

    def remark(self) -> str:
        """Return a sentence on late polls and late replies; empty without any."""
        return self._lateness.remark()

    def look(self, *, closed: bool, restore: Callable[[], None]) -> Stop | None:
        """Poll if due, and return the violation that stops the hand, or None.

        Args:
            closed: whether the hand may be closed; only then the `unwatched_s` threshold applies.
            restore: called after an answered poll; its AeroError counts as a missing reply.

        Raises:
            ConnectionError: the link is lost.
        """
        now = self._clock.now()
        if now < self.due:
            return None
        silent = False
        if self._hand.silent_from is None:  # otherwise the delay is the program's wait for the board
            # The duration of the previous poll does not make this one late.
            late_s = now - max(self.due, self._looked_at + self._thresholds.look_s)
            if self._lateness.began(now, late_s):
                _LOG.info("%s: guard poll %.2f s late", self._hand.name, late_s)
        try:
            violation = self._unwatched(now, closed) or self._read()
            self._lateness.answered(self._clock.now(), self._clock.now() - now)
            restore()
        except AeroError as error:
            _LOG.info("%s: a poll was not answered: %s", self._hand.name, error)
            # Unanswered requests of the program itself count too.
            asked = now if self._hand.silent_from is None else min(now, self._hand.silent_from)
            violation = self.watch.unanswered(asked, self._clock.now())
            silent = True
        self._looked_at = self._clock.now()
        self.due = now + self._thresholds.look_s
        return None if violation is None else Stop(violation, silent)

    def _unwatched(self, now: float, closed: bool) -> Violation | None:
        """Return the violation for a closed hand without a poll for `unwatched_s`, or None."""
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
        self.codes = codes.astype(np.int64)
        self.gate.seen(codes)
        self.currents_a, self.read_at = self._hand.read_currents(), reading.replied
        violation = self.watch.look(reading, self.currents_a)
        if violation is None and reading.replied >= self._temperatures_due:
            self._temperatures_due = reading.replied + self._thresholds.temperature_look_s
            self.celsius = self._hand.read_temperatures()
            violation = self.watch.temperatures(self.celsius)
        return violation
