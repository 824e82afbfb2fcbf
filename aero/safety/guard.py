"""The guard of a hand: it starts it gently, and polls it before whatever a program asks of it."""

from __future__ import annotations

import logging
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel
from aero.clock import Clock
from aero.driver import AeroHand
from aero.errors import RefusedError
from aero.firmware import ServoSettings
from aero.protocol import MAX_CODE, Centred, position_codes
from aero.safety.ending import EndingHand
from aero.safety.opening import OPEN, move_slowly
from aero.safety.standby import Standby
from aero.safety.stop import Health, Phase, SafetyReason, SafetyStopError, Violation
from aero.safety.thresholds import Thresholds
from aero.safety.watchdog import WatchedClock

_LOG = logging.getLogger(__name__)


class Guard(EndingHand):
    """Stands between a program and an `AeroHand`; every method but `end` runs in a `turn`."""

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
        super().__init__(hand, clock, spans_counts=spans_counts, usual=usual, thresholds=thresholds, standby=standby)
        self.clock: Clock = WatchedClock(clock, self.poll_alone, thresholds.look_s)
        """Waiting on it watches the hand."""
        self._own_clock = WatchedClock(clock, self.poll, thresholds.look_s)
        self._in_torque_mode = False

    def check(self) -> Health:
        """Read what a hand at rest says; raises SafetyStopError as `GuardedHand.check`."""
        self.poll()
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

    def start(self, goal: ArrayLike = OPEN) -> None:
        """Check a hand that has not moved yet, open it gently, see that it has opened, and go gently to a goal (7,).

        A start that an exception interrupted is made again from its beginning.
        """
        if self.phase is Phase.MOVING:
            return
        health = self.check()
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
        self.poll()
        self._limits.weaken(())
        self.phase = Phase.MOVING

    def command(self, codes: NDArray[np.int64]) -> None:
        """Send every channel to a position, (7,); slowly if the hand has not moved yet."""
        self.start(codes)
        self._command(codes)

    def command_torques(self, magnitudes: NDArray[np.int64]) -> None:
        """Pull channels closed, (7,), with no goal that encoders could be compared with."""
        self.start()
        self.poll()
        self._lookout.watch.encoders.forget()
        self._closed = self._in_torque_mode = True
        self._hand.command_torques(magnitudes)

    def expect_stops(self, channels: Iterable[Channel]) -> None:
        """Give the usual limits, and weaker ones to the thumb and to `channels`."""
        self.start()
        self.poll()
        self._limits.weaken(channels)

    def limit_torques(self, most: int) -> None:
        """Give the usual limits, but no channel more torque than `most` register units."""
        self.expect_stops(())
        for channel in Channel:
            if (limits := self._limits.of(channel)) is not None:
                self.limit(channel, torque=min(limits.torque, most))

    def limit(self, channel: Channel, **changed: int) -> None:
        """Change a channel's `speed` or `torque`, register units; opens the hand first if nothing has moved yet.

        Raises:
            RefusedError: the firmware has no limits; nothing is sent.
        """
        if not self._limits.settable:  # its board would stay silent for a second, in which nothing watches the hand
            raise RefusedError(f"{self._hand.name}: its firmware has no speed and torque limits. Nothing was sent.")
        self.start()
        for name, register_units in changed.items():
            self.poll()
            self._limits.change(channel, name, register_units)

    def calibrate_mid(self, channel: Channel) -> Centred:
        """Calibrate a channel of a hand that holds still; `GuardedHand.calibrate_mid`."""
        self.start()
        self.poll()
        before = self._limits.of(channel)
        if before is None:
            return self._hand.calibrate_mid(channel)
        gentle = self.thresholds
        self.limit(channel, speed=gentle.gentle_speed, torque=gentle.gentle_torque)
        try:
            # The command ends torque mode, and the servo takes the limits with it.
            self._command(position_codes(self._hand.read_codes()) if self._in_torque_mode else self._last_codes)
            self.poll()
            result = self._hand.calibrate_mid(channel)
            self._lookout.watch.pause()  # what was commanded meant other angles
            codes = self._last_codes.copy()
            codes[channel] = result.code
            self._command(codes)
        finally:
            self.limit(channel, speed=before.speed, torque=before.torque)
        return result

    def home(self, timeout_s: float) -> None:
        """Open the hand slowly, and home it; `GuardedHand.home`."""
        if self.phase is Phase.MOVING:
            self.poll()
            self._ramp(self._hand.read_codes(), OPEN)
            self._own_clock.sleep_until(self._bare_clock.now() + self.thresholds.opening_s / 4)
        self.start()
        self.poll()
        self._hand.home(timeout_s)
        self._lookout.pause()

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

    def _command(self, codes: NDArray[np.int64]) -> None:
        self.poll()
        closed, before = bool((codes > self.thresholds.arrival * MAX_CODE).any()), self._last_codes
        # Noted first: an interrupt may come after the frame has gone out and before this method continues.
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
