"""The guard of a hand: it starts it gently, polls it while a program moves it, and opens it at the end."""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable, Iterable
from typing import NoReturn, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.acknowledgement import Centred
from aero.channels import Channel
from aero.clock import Clock
from aero.driver import TELEMETRY_AGE_PRE_S, TELEMETRY_AGE_S, AeroHand
from aero.firmware import ServoSettings
from aero.protocol import MAX_CODE, position_codes, torque_magnitudes
from aero.safety.interrupts import uninterrupted
from aero.safety.kept_limits import KeptLimits
from aero.safety.lookout import Lookout
from aero.safety.opening import OPEN, SWITCH_OFF, Doubt, move_slowly, open_and_relax
from aero.safety.standby import Standby
from aero.safety.state import Health, Phase
from aero.safety.stop import LinkLostError, SafetyReason, SafetyStopError, Violation
from aero.safety.thresholds import Thresholds
from aero.safety.watchdog import Watchdog, WatchedClock

P = ParamSpec("P")
T = TypeVar("T")
_LOG = logging.getLogger(__name__)
ENDED = Violation(SafetyReason.ENDED, "The program ended")
"""Nothing was wrong."""
WATCHDOG_S = 0.5
"""Time from one check of whether a hand on a port goes unwatched to the next, s."""


class Guard:
    """Stands between a program and an `AeroHand`.

    The lock covers one call of the program, with the poll before it: a slow start, a command, a reading, the last
    opening. So no call of one thread comes between the steps of another's. Threads that call during the last opening
    are refused at once. Methods that begin with an underscore run inside such a call.
    """

    def __init__(
        self,
        hand: AeroHand,
        clock: Clock,
        *,
        spans_counts: ArrayLike,
        usual: ServoSettings | None,
        thresholds: Thresholds,
        standby: Standby | None,
    ) -> None:
        """Guard a hand that nothing has moved yet; the arguments are those of `GuardedHand`."""
        self.phase = Phase.RESTING
        self.thresholds = thresholds
        self.clock: Clock = WatchedClock(clock, self.poll, thresholds.look_s)
        """Waiting on it watches the hand."""
        self._own_clock = WatchedClock(clock, self._poll, thresholds.look_s)
        self._bare_clock = clock
        self._limits = KeptLimits(hand, usual, thresholds)
        self._last_codes = position_codes(OPEN)
        self._in_torque_mode = False
        self._hand = hand
        self._standby = standby
        self._owner = os.getpid()
        telemetry_s = TELEMETRY_AGE_PRE_S if usual is None else TELEMETRY_AGE_S
        self._lookout = Lookout(hand, clock, thresholds, spans_counts, telemetry_s)
        self._closed = False
        self._is_open = True
        self._ending = ENDED
        """Why it is opened for the last time."""
        self._stop: SafetyStopError | None = None
        self._watchdog = Watchdog(self._poll_for_the_program, WATCHDOG_S)
        self._lock = threading.RLock()  # reentrant: a signal handler may close the hand in the middle of a call

    def exchange(self, call: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Poll the hand if it is time, and carry out one call of its driver.

        Raises:
            SafetyStopError: the hand was stopped, now or earlier, or belongs to the process that forked this one.
        """

        def polled() -> T:
            self._poll()
            return call(*args, **kwargs)

        return self._alone(polled)

    def poll(self) -> None:
        """Poll the hand if it is time; raises as `exchange`."""
        self._alone(self._poll)

    def check(self) -> Health:
        """Read what a hand at rest says; `GuardedHand.check`."""
        return self._alone(self._check)

    def start(self) -> None:
        """Open a hand gently that has not moved yet; `GuardedHand.begin`."""
        self._alone(self._start)

    def command(self, codes: ArrayLike) -> None:
        """Send every channel to a position, (7,); slowly if the hand has not moved yet."""
        goal = position_codes(codes)

        def started() -> None:
            self._start(goal)
            self._command(goal)

        self._alone(started)

    def command_torques(self, magnitudes: ArrayLike) -> None:
        """Pull channels closed, (7,), with no goal that encoders could be compared with."""
        asked = torque_magnitudes(magnitudes)

        def started() -> None:
            self._start()
            self._poll()
            self._lookout.watch.encoders.forget()
            self._closed = self._in_torque_mode = True
            self._hand.command_torques(asked)

        self._alone(started)

    def expect_stops(self, channels: Iterable[Channel]) -> None:
        """Give the usual limits, and weaker ones to the thumb and to `channels`."""
        weak = tuple(map(Channel, channels))

        def started() -> None:
            self._start()
            self._poll()
            self._limits.weaken(weak)

        self._alone(started)

    def limit_torques(self, most: int) -> None:
        """Give the usual limits, but no channel more torque than `most` register units."""

        def started() -> None:
            self._start()
            self._poll()
            self._limits.weaken(())
            for channel in Channel:
                if (limits := self._limits.of(channel)) is not None:
                    self._limit(channel, torque=min(limits.torque, most))

        self._alone(started)

    def limit(self, channel: Channel, **changed: int) -> None:
        """Change a channel's `speed` or `torque`, register units; opens the hand first if nothing has moved yet."""

        def started() -> None:
            self._start()
            self._limit(channel, **changed)

        self._alone(started)

    def calibrate_mid(self, channel: Channel) -> Centred:
        """Calibrate a channel of a hand that holds still; `GuardedHand.calibrate_mid`."""

        def started() -> Centred:
            self._start()
            self._poll()
            before = self._limits.of(channel)
            if before is None:
                return self._hand.calibrate_mid(channel)
            gentle = self.thresholds
            self._limit(channel, speed=gentle.gentle_speed, torque=gentle.gentle_torque)
            try:
                # The command ends torque mode, and the servo takes the limits with it.
                self._command(position_codes(self._hand.read_codes()) if self._in_torque_mode else self._last_codes)
                self._poll()
                result = self._hand.calibrate_mid(channel)
                self._lookout.watch.pause()  # what was commanded meant other angles
                codes = self._last_codes.copy()
                codes[channel] = result.code
                self._command(codes)
            finally:
                self._limit(channel, speed=before.speed, torque=before.torque)
            return result

        return self._alone(started)

    def home(self, timeout_s: float) -> None:
        """Open the hand slowly, and home it; `GuardedHand.home`."""

        def opened() -> None:
            if self.phase is Phase.MOVING:
                self._poll()
                self._ramp(self._hand.read_codes(), OPEN)
                self._own_clock.sleep_until(self._bare_clock.now() + self.thresholds.opening_s / 4)
            self._start()
            self._poll()
            self._hand.home(timeout_s)
            self._lookout.pause()

        self._alone(opened)

    def end(self) -> None:
        """Open the hand if the program has moved it, and give the port back; `GuardedHand.close`."""
        if os.getpid() != self._owner:
            return
        before = self._stop
        self._watchdog.end()
        try:
            try:
                self._open_at_the_end()
            finally:
                # An interrupt may have come before the first call held it back; else this one does nothing.
                self._open_at_the_end()
        finally:
            try:
                self._hand.close()
                if self._standby is not None:
                    (self._standby.stand_down if self._is_open else self._standby.take_over)()
            finally:
                if self._stop is not None and self._stop is not before and not self._is_open:
                    raise self._stop  # this has to be said, whatever the signal was

    def _alone(self, work: Callable[[], T]) -> T:
        """Do something that no other thread comes between."""
        self._refuse()
        with self._lock:
            return work()

    def _refuse(self) -> None:
        """Refuse a call that the hand takes from nobody now, or not from here.

        Raises:
            SafetyStopError: it is being opened for the last time, was stopped, or belongs to another process.
        """
        if os.getpid() != self._owner:
            raise SafetyStopError(
                f"{self._hand.name}: this process was forked; the hand belongs to the one that opened it.",
                SafetyReason.FORKED,
            )
        if self._stop is not None:
            raise SafetyStopError(str(self._stop), self._stop.reason, self._stop.channel, self._stop.unanswered)
        if self.phase is Phase.ENDING:
            raise SafetyStopError(
                f"{self._hand.name}: it is being opened for the last time. {self._ending.text}.",
                self._ending.reason,
                self._ending.channel,
            )

    def _poll(self) -> None:
        """Poll the hand if it is time; nothing happens before the first motion. Raises as `_refuse`."""
        self._refuse()
        if self.phase not in {Phase.OPENING, Phase.MOVING}:
            return
        stop = self._lookout.look(closed=self._closed, restore=lambda: self._limits.restore(self._last_codes))
        if stop is not None:
            self._abort(stop.violation, silent=stop.silent)

    def _poll_for_the_program(self) -> None:
        """Poll a hand on a port that goes unwatched, which stops it."""
        if self._closed and self._lookout.unwatched_s > self.thresholds.unwatched_s:
            self.poll()

    def _check(self) -> Health:
        self._poll()
        hand = self._hand
        health = Health(hand.read_codes(), hand.read_currents(), hand.read_temperatures())
        violation = self._lookout.watch.temperatures(health.temperatures_c)
        most = Channel(int(np.argmax(np.abs(health.currents_a))))
        drawn = abs(health.currents_a[most])
        if violation is None and drawn > self.thresholds.current_a:
            violation = Violation(
                SafetyReason.CURRENT_AT_REST,
                f"{most.label} draws {drawn:.1f} A at rest (limit {self.thresholds.current_a:g} A): it holds against "
                "something; take it out, or open the hand by hand",
                most,
            )
        if violation is not None:
            raise SafetyStopError(
                f"{self._hand.name}: not moved. {violation.text}.", violation.reason, violation.channel
            )
        return health

    def _start(self, goal: ArrayLike = OPEN) -> None:
        """Check a hand that has not moved yet, open it gently, see that it has opened, and go gently to a goal (7,).

        A start that an exception interrupted is made again from its beginning.
        """
        if self.phase is Phase.MOVING:
            return
        health = self._check()
        if self._standby is not None:
            self._standby.start()
            self._watchdog.start()
        self.phase, self._is_open = Phase.OPENING, False
        self._limits.begin()
        self._ramp(health.codes, OPEN)
        self._own_clock.sleep_until(self._bare_clock.now() + self.thresholds.opening_s / 4)
        self._expect_open()
        self._ramp(OPEN, goal)
        _LOG.info("%s: opened slowly, and watched from now on", self._hand.name)
        self._poll()
        self._limits.weaken(())
        self.phase = Phase.MOVING

    def _ramp(self, start_codes: ArrayLike, goal_codes: ArrayLike) -> None:
        """Move all channels slowly."""
        last = self._last_codes

        def command(codes: NDArray[np.int64]) -> None:
            nonlocal last
            if self._last_codes is not last:
                raise RuntimeError(f"{self._hand.name}: a signal handler has commanded it during a slow motion")
            self._command(codes)
            last = self._last_codes

        move_slowly(command, self._own_clock, start_codes, goal_codes, self.thresholds.opening_s)

    def _limit(self, channel: Channel, **changed: int) -> None:
        for name, register_units in changed.items():
            self._poll()
            self._limits.change(channel, name, register_units)

    def _command(self, codes: NDArray[np.int64]) -> None:
        self._poll()
        closed, before = bool((codes > self.thresholds.arrival * MAX_CODE).any()), self._last_codes
        # Noted first: an interrupt may come after the frame has gone out and before this method goes on.
        self._last_codes, self._closed = codes, self._closed or closed
        try:
            self._hand.command_codes(codes)
        except Exception:
            self._last_codes = before  # it has not gone out as a whole
            raise
        self._in_torque_mode = False
        self._closed = closed
        self._lookout.watch.encoders.commanded(self._bare_clock.now(), codes / MAX_CODE)

    def _expect_open(self) -> None:
        shares = self._hand.read_codes() / MAX_CODE
        worst = Channel(int(np.argmax(shares)))
        if shares[worst] > self.thresholds.arrival:
            text = (
                f"{worst.label} is still {shares[worst]:.0%} closed after the hand was opened slowly: it is "
                "blocked, its servo has no torque, or its zero is lost; home the hand"
            )
            self._abort(Violation(SafetyReason.STILL_CLOSED, text, worst))
        self._lookout.watch.encoders.found(self._bare_clock.now(), shares)

    def _open_at_the_end(self) -> None:
        with uninterrupted(), self._lock:
            # ENDING: an exception has interrupted the opening.
            if self.phase in {Phase.OPENING, Phase.MOVING, Phase.ENDING}:
                self._open(None)

    def _abort(self, violation: Violation, *, silent: bool = False) -> NoReturn:
        """Stop the hand for a violation.

        Raises:
            SafetyStopError: always, unless a signal that came meanwhile raises its own for a hand that is open.
        """
        violation = violation._replace(text=violation.text + self._lookout.remark())
        stop: SafetyStopError | None = None
        try:
            with uninterrupted():
                stop = self._open(violation, silent=silent)
        finally:
            if stop is not None and not self._is_open:
                raise stop  # this has to be said, whatever the signal was
        raise stop

    def _open(self, violation: Violation | None, *, silent: bool = False) -> SafetyStopError:
        """Open slowly and leave weak; the hand takes no more commands of the program.

        Args:
            violation: what stops the hand; None when the program ended.
            silent: whether the board has just left questions unanswered: it is not asked first where its hand stands.

        Returns:
            What every later call raises; also now, when the hand may not be open.
        """
        stop = violation or ENDED
        self._ending, self.phase = stop, Phase.ENDING
        kind: type[SafetyStopError] = SafetyStopError
        try:
            doubt = open_and_relax(
                self._hand,
                self._bare_clock,
                self.thresholds,
                settable=self._limits.settable,
                last_codes=self._last_codes,
                silent=silent,
            )
        except ConnectionError as error:
            doubt = Doubt(str(error))
            if violation is None:
                stop, kind = Violation(SafetyReason.LINK_LOST, "The link was lost"), LinkLostError
        self._is_open = doubt is None
        text = f"{self._hand.name}: {'stopped and opened slowly' if doubt is None else 'stopped'}. {stop.text}."
        if doubt is None:
            self._stop = SafetyStopError(text, stop.reason, stop.channel)
            _LOG.log(logging.INFO if violation is None else logging.WARNING, text)
        else:
            text += f" {SWITCH_OFF}, because {doubt.text}"
            reason = SafetyReason.NOT_OPENED if stop.reason is SafetyReason.ENDED else stop.reason
            self._stop = kind(text, reason, stop.channel, doubt.unanswered)
            _LOG.error(text)
        self.phase = Phase.STOPPED
        return self._stop
