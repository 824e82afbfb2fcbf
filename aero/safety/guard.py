"""The guard of a hand: it starts it gently, looks at it while a program moves it, and opens it at the end."""

from __future__ import annotations

import logging
import os
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero import protocol
from aero.channels import Channel
from aero.clock import Clock
from aero.driver import TELEMETRY_AGE_PRE_S, TELEMETRY_AGE_S, AeroHand
from aero.firmware import ServoSettings
from aero.protocol import MAX_CODE
from aero.safety.interrupts import uninterrupted
from aero.safety.kept_limits import KeptLimits
from aero.safety.lookout import Lookout
from aero.safety.opening import OPEN, SWITCH_OFF, Doubt, move_slowly, open_and_relax
from aero.safety.standby import Standby
from aero.safety.state import Health, Phase
from aero.safety.stop import LinkLostError, SafetyReason, SafetyStopError, Violation
from aero.safety.thresholds import Thresholds
from aero.safety.watched_clock import WatchedClock

_LOG = logging.getLogger(__name__)


class Guard:
    """Stands between a program and an `AeroHand`, which the program reaches by `permit` alone."""

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
        self.clock: Clock = WatchedClock(clock, self._look, thresholds.look_s)
        """Waiting on it watches the hand."""
        self.limits = KeptLimits(hand, usual, thresholds)
        self.last_codes: NDArray[np.integer] = np.array(OPEN)
        """The program's last position command, (7,)."""
        self.in_torque_mode = False
        self._hand = hand
        self._bare_clock = clock
        self._standby = standby
        self._owner = os.getpid()
        telemetry_s = TELEMETRY_AGE_PRE_S if usual is None else TELEMETRY_AGE_S
        self._lookout = Lookout(hand, clock, thresholds, spans_counts, telemetry_s)
        self._closed = False
        self._is_open = True
        self._stop: SafetyStopError | None = None

    def permit(self) -> AeroHand:
        """Look at the hand if it is time, and return it for one exchange.

        Raises:
            SafetyStopError: the hand was stopped, now or earlier, or belongs to the process that forked this one.
        """
        self._look()
        return self._hand

    def check(self) -> Health:
        """Read what a hand at rest says; `GuardedHand.check`."""
        hand = self.permit()
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

    def start(self, goal: ArrayLike = OPEN) -> None:
        """Check a hand that has not moved yet, open it gently, see that it has opened, and go gently to a goal (7,)."""
        if self.phase is not Phase.RESTING:
            return
        health = self.check()
        if self._standby is not None:
            self._standby.start()
        self.phase, self._is_open = Phase.OPENING, False
        self.limits.begin()
        opening_s = self.thresholds.opening_s
        move_slowly(self.command, self.clock, health.codes, OPEN, opening_s)
        self.clock.sleep_until(self._bare_clock.now() + opening_s / 4)
        self._expect_open()
        move_slowly(self.command, self.clock, OPEN, goal, opening_s)
        self.phase = Phase.MOVING
        _LOG.info("%s: opened slowly, and watched from now on", self._hand.name)
        self.expect_stops(())

    def expect_stops(self, channels: tuple[Channel, ...]) -> None:
        """Give the usual limits, and weaker ones to the thumb and to `channels`."""
        self.permit()
        self.limits.weaken(channels)

    def command(self, codes: ArrayLike) -> None:
        """Send every channel to a position, (7,)."""
        codes = np.asarray(codes)
        self.permit().command_codes(codes)
        self.last_codes = codes
        self.in_torque_mode = False
        self._closed = bool((codes > self.thresholds.arrival * MAX_CODE).any())
        self._lookout.watch.encoders.commanded(self._bare_clock.now(), codes / MAX_CODE)

    def command_torques(self, magnitudes: ArrayLike) -> None:
        """Pull channels closed, (7,), with no goal that encoders could be compared with."""
        protocol.make_torques(magnitudes)
        hand = self.permit()
        self._lookout.watch.encoders.forget()
        self._closed = self.in_torque_mode = True
        hand.command_torques(magnitudes)

    def forget_commands(self) -> None:
        """Expect nothing of encoders until the next command: what was commanded meant other angles."""
        self._lookout.watch.pause()

    def open_slowly(self) -> None:
        """Open a hand that the program has moved, and go on."""
        if self.phase is Phase.MOVING:
            move_slowly(self.command, self.clock, self.permit().read_codes(), OPEN, self.thresholds.opening_s)
            self.clock.sleep_until(self._bare_clock.now() + self.thresholds.opening_s / 4)

    def homed(self) -> None:
        """Watch anew after a homing, during which the board answers nothing."""
        self._lookout.pause()

    def end(self) -> None:
        """Open the hand if the program has moved it, and give the port back; `GuardedHand.close`."""
        if os.getpid() != self._owner:
            return
        standby, self._standby = self._standby, None
        try:
            if self.phase in {Phase.OPENING, Phase.MOVING}:
                self._open(None)
        finally:
            self._hand.close()
            if standby is not None:
                (standby.stand_down if self._is_open else standby.take_over)()

    def _look(self) -> None:
        """Look at the hand if it is time; nothing happens before the first motion."""
        if os.getpid() != self._owner:
            raise SafetyStopError(
                f"{self._hand.name}: this process was forked; the hand belongs to the one that opened it.",
                SafetyReason.FORKED,
            )
        if self._stop is not None:
            raise SafetyStopError(str(self._stop), self._stop.reason, self._stop.channel, self._stop.unanswered)
        if self.phase not in {Phase.OPENING, Phase.MOVING}:
            return
        stop = self._lookout.look(closed=self._closed, restore=lambda: self.limits.restore(self.last_codes))
        if stop is not None:
            self._abort(stop.violation, silent=stop.silent)

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

    def _abort(self, violation: Violation, *, silent: bool = False) -> NoReturn:
        remark = self._lookout.remark()
        raise self._open(violation._replace(text=violation.text + remark), silent=silent)

    def _open(self, violation: Violation | None, *, silent: bool = False) -> SafetyStopError:
        """Open slowly and leave weak; the hand takes no more commands of the program.

        A board that was just found `silent` is not asked first where its hand stands.

        A signal that comes meanwhile is carried out afterwards, but for a hand that may be closed.

        Args:
            violation: what stops the hand; None when the program ended.
            silent: whether the board has just left questions unanswered.

        Returns:
            What every later call raises.

        Raises:
            SafetyStopError: the hand may not be open; this has to be said, whatever the signal was.
            LinkLostError: the same, because the link was lost, and nothing else was wrong.
        """
        self.phase = Phase.ENDING
        stop = violation or Violation(SafetyReason.ENDED, "The program ended")
        kind: type[SafetyStopError] = SafetyStopError
        with uninterrupted():
            try:
                doubt = open_and_relax(
                    self._hand,
                    self._bare_clock,
                    self.thresholds,
                    settable=self.limits.settable,
                    last_codes=self.last_codes,
                    silent=silent,
                )
            except ConnectionError as error:
                doubt = Doubt(str(error))
                if violation is None:
                    stop, kind = Violation(SafetyReason.LINK_LOST, "The link was lost"), LinkLostError
            finally:
                self.phase = Phase.STOPPED
            self._is_open = doubt is None
            text = f"{self._hand.name}: {'stopped and opened slowly' if doubt is None else 'stopped'}. {stop.text}."
            if doubt is None:
                self._stop = SafetyStopError(text, stop.reason, stop.channel)
                _LOG.log(logging.INFO if violation is None else logging.WARNING, text)
                return self._stop
            text += f" {SWITCH_OFF}, because {doubt.text}"
            reason = SafetyReason.NOT_OPENED if stop.reason is SafetyReason.ENDED else stop.reason
            self._stop = kind(text, reason, stop.channel, doubt.unanswered)
            _LOG.error(text)
            raise self._stop
