"""Guard of a hand: polls, stops and finally opens it."""

import logging
import math
import os
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.clock import Clock
from aero.driver import TELEMETRY_AGE_PRE_S, TELEMETRY_AGE_S, AeroHand
from aero.firmware import ServoSettings
from aero.protocol import MAX_CODE, position_codes
from aero.safety.interrupts import uninterrupted
from aero.safety.opening import OPEN, SWITCH_OFF, open_and_relax
from aero.safety.servo_limits import ServoLimits
from aero.safety.standby import Standby
from aero.safety.stop import LinkLostError, Phase, SafetyReason, SafetyStopError, Violation
from aero.safety.thresholds import Thresholds
from aero.safety.watch import Lookout
from aero.safety.watchdog import Watchdog

_LOG = logging.getLogger(__name__)
ENDED = Violation(SafetyReason.ENDED, "The program ended")
"""Placeholder for a normal end, without a violation."""
WATCHDOG_S = 0.5


# In the program's own process, because a guard in another process would own the port and delay each exchange by two
# process switches. Only a killed program cannot open its hand; a standby process then takes the released port.
class Guard:
    """State machine that polls a hand from its first motion to its final opening, and refuses commands afterwards.

    The lock covers one call of the program including the poll before it: a slow start, a command, a reading, the final
    opening. Calls of different threads therefore never interleave. Calls during the final opening are refused at once.
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
        """Wrap a hand before its first motion; arguments as `GuardedHand`."""
        self.phase = Phase.RESTING
        self.limits = ServoLimits(hand, usual, thresholds)
        telemetry_s = TELEMETRY_AGE_PRE_S if usual is None else TELEMETRY_AGE_S
        self.lookout = Lookout(hand, clock, thresholds, spans_counts, telemetry_s)
        self._encoders = self.lookout.watch.encoders
        self.last_codes = position_codes(OPEN)
        self.commands = 0
        """Number of position commands, including failed ones."""
        self.in_torque_mode = False
        self._thresholds = thresholds
        self._clock = clock
        self._hand = hand
        self._standby = standby
        self._owner = os.getpid()
        self._closed = False
        self._is_open = True
        self._ending = ENDED
        self._stop: SafetyStopError | None = None
        self._homed_by = -math.inf
        """Latest end of a homing in progress, s."""
        self._watchdog = Watchdog(self._poll_for_the_program, WATCHDOG_S)
        self._lock = threading.RLock()  # reentrant: a signal handler may close the hand in the middle of a call

    def turn(self) -> AbstractContextManager[bool]:
        """Return the lock for one call of the program.

        Raises:
            SafetyStopError: final opening in progress, hand stopped, or hand of another process.
        """
        self._refuse()
        return self._lock

    def poll(self) -> None:
        """Poll the hand if due, after its first motion only; stop it for a violation. Raises as `turn` and `abort`."""
        self._refuse()
        if self.phase not in {Phase.OPENING, Phase.MOVING}:
            return
        stop = self.lookout.look(closed=self._closed, restore=lambda: self.limits.restore(self.last_codes))
        if stop is not None:
            self.abort(stop.violation, silent=stop.silent)
        if (further := self.lookout.gate.released()) is not None:
            self._send(further)

    def poll_alone(self) -> None:
        """Poll the hand under the lock."""
        with self.turn():
            self.poll()

    def begin(self) -> None:
        """Start standby process and watchdog of a hand on a port, and set gentle limits."""
        if self._standby is not None:
            self._standby.start()
            self._watchdog.start()
        self.phase, self._is_open = Phase.OPENING, False
        self.limits.begin()

    def command(self, codes: NDArray[np.int64]) -> None:
        """Poll the hand, send every channel to a position (7,) or the edge before it, and expect the encoders there."""
        self.poll()
        self.commands += 1
        self._send(self.lookout.gate.passed(codes))

    def _send(self, codes: NDArray[np.int64]) -> None:
        nearest, before = self.lookout.gate.outcome(OPEN), self.last_codes
        closed = bool((codes - nearest > self._thresholds.arrival * MAX_CODE).any())
        # Recorded before sending, because an interrupt may follow the frame before this method continues.
        self.last_codes, self._closed = codes, self._closed or closed
        try:
            self._hand.command_codes(codes)
        except Exception:
            self.last_codes = before  # the frame was not sent completely
            raise
        self.in_torque_mode = False
        self._closed = closed
        self._encoders.commanded(self._clock.now(), codes / MAX_CODE)

    def command_torques(self, magnitudes: NDArray[np.int64]) -> None:
        """Poll the hand, and pull channels closed with torques (7,), without a check of the encoders.

        Raises:
            SafetyStopError: the hand has forbidden regions, at whose edges a torque does not stop; nothing is sent.
        """
        if self._thresholds.forbidden:
            raise SafetyStopError(
                f"{self._hand.name}: a hand with forbidden regions takes no torques, because only a position can "
                "stop at an edge. Nothing was sent."
            )
        self.poll()
        self._encoders.forget()
        self._closed = self.in_torque_mode = True
        self._hand.command_torques(magnitudes)

    def temperatures(self, celsius: NDArray[np.float64]) -> Violation | None:
        """Return the violation in temperatures (7,) °C, or None."""
        return self.lookout.watch.temperatures(celsius)

    def pause(self) -> None:
        """Drop past commands."""
        self.lookout.watch.pause()
        self.lookout.gate.forget()

    @contextmanager
    def homing(self, timeout_s: float) -> Iterator[None]:
        """Home the hand in the block, in which the board is silent; drop past commands, and restart the polls.

        After an interrupt the board homes on, so that the final opening waits until it answers, or for `timeout_s`.
        """
        self._homed_by = self._clock.now() + timeout_s
        yield
        self._homed_by = -math.inf
        self.lookout.pause()

    def found(self, shares: NDArray[np.float64]) -> None:
        """Record the positions (7,), fraction of the window, at the end of the slow opening."""
        self._encoders.found(self._clock.now(), shares)

    def abort(self, violation: Violation, *, silent: bool = False) -> NoReturn:
        """Stop the hand for a violation.

        Raises:
            SafetyStopError: always, unless the hand has opened and a signal meanwhile raises its own exception.
        """
        violation = violation._replace(text=violation.text + self.lookout.remark())
        stop: SafetyStopError | None = None
        try:
            with uninterrupted():
                stop = self._open(violation, silent=silent)
        finally:
            if stop is not None and not self._is_open:
                raise stop  # a hand that may be closed takes precedence over the signal
        raise stop

    def end(self) -> None:
        """Open the hand if the program has moved it, and release the port; `GuardedHand.close`."""
        if os.getpid() != self._owner:
            return
        before = self._stop
        self._watchdog.end()
        try:
            try:
                self._open_at_the_end()
            finally:
                # An interrupt may precede the first call's signal mask; otherwise this call does nothing.
                self._open_at_the_end()
        finally:
            try:
                self._hand.close()
                if self._standby is not None:
                    (self._standby.stand_down if self._is_open else self._standby.take_over)()
            finally:
                if self._stop is not None and self._stop is not before and not self._is_open:
                    raise self._stop  # as in `abort`

    def _refuse(self) -> None:
        """Refuse a call to a hand that is not available to this process.

        Raises:
            SafetyStopError: final opening in progress, hand stopped, or hand of another process.
        """
        if os.getpid() != self._owner:
            raise SafetyStopError(
                f"{self._hand.name}: this process was forked; the hand belongs to the one that opened it.",
                SafetyReason.FORKED,
            )
        if self._stop is not None:
            raise SafetyStopError(str(self._stop), self._stop.reason, self._stop.channel)
        if self.phase is Phase.ENDING:
            raise SafetyStopError(
                f"{self._hand.name}: its final opening is in progress. {self._ending.text}.",
                self._ending.reason,
                self._ending.channel,
            )

    def _poll_for_the_program(self) -> None:
        """Poll a closed hand after `unwatched_s` without a poll by the program; the poll then stops the hand."""
        if self._closed and self.lookout.unwatched_s > self._thresholds.unwatched_s:
            self.poll_alone()

    def _open_at_the_end(self) -> None:
        with uninterrupted(), self._lock:
            # ENDING: an exception has interrupted the opening.
            if self.phase in {Phase.OPENING, Phase.MOVING, Phase.ENDING}:
                self._open(None)

    def _open(self, violation: Violation | None, *, silent: bool = False) -> SafetyStopError:
        """Open the hand slowly, limit its torque, and refuse all later commands of the program.

        Args:
            violation: reason for the stop; None at the end of the program.
            silent: whether the board has just not answered; the ramp then starts without reading the position.

        Returns:
            Exception for every later call; the caller raises it if the hand may not be open.
        """
        stop = violation or ENDED
        self._ending, self.phase = stop, Phase.ENDING
        kind: type[SafetyStopError] = SafetyStopError
        try:
            doubt = open_and_relax(
                self._hand,
                self._clock,
                self._thresholds,
                settable=self.limits.settable,
                last_codes=self.last_codes,
                silent=silent,
                homes_s=max(self._homed_by - self._clock.now(), 0.0),
            )
        except ConnectionError as error:
            doubt = str(error)
            if violation is None:
                stop, kind = Violation(SafetyReason.LINK_LOST, "The link was lost"), LinkLostError
        self._is_open = doubt is None
        text = f"{self._hand.name}: {'stopped and opened slowly' if doubt is None else 'stopped'}. {stop.text}."
        if doubt is None:
            self._stop = SafetyStopError(text, stop.reason, stop.channel)
            _LOG.log(logging.INFO if violation is None else logging.WARNING, text)
        else:
            text += f" {SWITCH_OFF}, because {doubt}"
            reason = SafetyReason.NOT_OPENED if stop.reason is SafetyReason.ENDED else stop.reason
            self._stop = kind(text, reason, stop.channel)
            _LOG.error(text)
        self.phase = Phase.STOPPED
        return self._stop
