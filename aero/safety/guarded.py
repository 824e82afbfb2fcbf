"""A hand that is watched while a program moves it."""

from __future__ import annotations

import logging
import weakref
from collections.abc import Callable, Iterable
from functools import update_wrapper
from typing import Concatenate, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero import protocol
from aero.channels import Channel
from aero.clock import Clock, positive_s
from aero.driver import HOMING_TIMEOUT_S, AeroHand, LinkedHand
from aero.errors import RefusedError
from aero.firmware import ServoSettings
from aero.link import PATIENCE_S
from aero.protocol import MAX_CODE, Centred
from aero.safety.guard import Guard
from aero.safety.opening import OPEN, move_slowly
from aero.safety.standby import Standby
from aero.safety.stop import Health, Phase, SafetyReason, SafetyStopError, Violation
from aero.safety.thresholds import Thresholds
from aero.safety.watchdog import WatchedClock
from aero.transport import Transport

_LOG = logging.getLogger(__name__)
STALL_TORQUE = 1000
"""Torque limit that stands for the stall torque, register units (Feetech: tenths of a per cent)."""

P = ParamSpec("P")
T = TypeVar("T")


def _polled(
    call: Callable[Concatenate[AeroHand, P], T], check: Callable[P, object] | None = None
) -> Callable[Concatenate[GuardedHand, P], T]:
    """Return a call of the driver as one of the guarded hand.

    `check` takes the same arguments and refuses wrong ones before anything is sent, a poll too.
    """

    def guarded(self: GuardedHand, /, *args: P.args, **kwargs: P.kwargs) -> T:
        if check is not None:
            check(*args, **kwargs)
        bound: Callable[P, T] = getattr(self._hand, call.__name__)
        with self._guard.turn():
            self._guard.poll()
            return bound(*args, **kwargs)

    update_wrapper(guarded, call)
    return guarded


class GuardedHand(LinkedHand):
    """A hand that starts gently, stops itself, and ends open and weak.

    Before the first motion it checks currents and temperatures, then opens slowly at limited speed and torque. Only
    a hand whose encoders all arrive continues, slowly to its first goal, and then gets its usual limits back. From then
    on every call, and every wait on `clock`, polls currents, encoders and temperatures as often as `Thresholds`
    says. What breaks a threshold opens the hand slowly and raises `SafetyStopError`, then and at every later call.
    `close`, and with it the end of a `with` statement, opens it in any case. Limits belong to the guard's state: after
    a restart of the board, or any exchange that did not go as it should, they are sent again.

    Threads may share a hand: each call is atomic. Only the process that made it may use it: a forked one is
    refused. While the board homes it answers nothing, so nothing is watched then.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        *,
        spans_counts: ArrayLike,
        usual: ServoSettings | None,
        thresholds: Thresholds | None = None,
        standby: Standby | None = None,
    ) -> None:
        """Wrap an open transport.

        Args:
            transport: the bytes' way to the board.
            clock: what tells the time and is waited on.
            spans_counts: (7,) servo counts of the channels' command windows, `CommandWindow.spans_counts()`.
            usual: the firmware's own limits, restored after the slow opening; None for a firmware that has no
                settings for them, whose start is slow in steps of position alone.
            thresholds: when to stop; the defaults when None.
            standby: the process that opens the hand should this one be killed; None for a hand in software.
        """
        self.thresholds = thresholds or Thresholds()
        """When it is stopped."""
        self._hand = AeroHand(transport, clock, PATIENCE_S)  # a board that is silent for 1 s is opened
        super().__init__(self._hand._link, clock)
        self._guard = guard = Guard(
            self._hand, clock, spans_counts=spans_counts, usual=usual, thresholds=self.thresholds, standby=standby
        )
        self._own_clock = WatchedClock(clock, guard.poll, self.thresholds.look_s)
        self.clock: Clock = WatchedClock(clock, guard.poll_alone, self.thresholds.look_s)
        """Wait on this one, so that the hand is watched meanwhile."""
        # For a program that forgets to close it, and for an interrupt at the very beginning of `close`.
        self._finalizer = weakref.finalize(self, self._guard.end)

    @property
    def phase(self) -> Phase:
        """What it is doing."""
        return self._guard.phase

    def check(self) -> Health:
        """Read positions, currents and temperatures; moves nothing.

        Raises:
            SafetyStopError: a temperature or a current is over its limit before anything moves.
            AeroError, ConnectionError: as `read_codes`.
        """
        with self._guard.turn():
            self._guard.poll()
            health = Health(self._hand.read_codes(), self._hand.read_currents(), self._hand.read_temperatures())
        violation = self._guard.temperatures(health.temperatures_c)
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
            raise SafetyStopError(f"{self.name}: not moved. {violation.text}.", violation.reason, violation.channel)
        return health

    def begin(self) -> None:
        """Check the hand and open it gently now, if nothing has moved yet, and not in the middle of the first command.

        Call it where the time of the first command matters.

        Raises:
            SafetyStopError: as `check`; or the hand did not open.
        """
        with self._guard.turn():
            self._start()

    def expect_stops(self, channels: Iterable[Channel]) -> None:
        """Weaken channels that are about to be driven into their stops, which is no reason to stop the hand then.

        The others get their usual limits; the thumb's channels are always weakened. Nothing happens with a firmware
        that has no torque settings. The board applies it with the next command.

        Raises:
            ValueError: there is no such channel; nothing is sent.
            SafetyStopError, AeroError: as `begin` and `set_torque`.
        """
        weak = tuple(map(Channel, channels))
        with self._guard.turn():
            self._start()
            self._guard.poll()
            self._guard.limits.weaken(weak)

    def limit_torques(self, share: float) -> None:
        """Let no channel use more than a fraction (0..1) of its stall torque; `expect_stops` ends it.

        Channels whose limit is lower keep it. Nothing happens with a firmware that has no torque settings. The board
        applies it with the next command.

        Raises:
            ValueError: no such fraction; nothing is sent.
            SafetyStopError, AeroError: as `begin` and `set_torque`.
        """
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"limit_torques: expected a share of the stall torque in 0..1, got {share!r}")
        with self._guard.turn():
            self.expect_stops(())
            for channel in Channel:
                if (limits := self._guard.limits.of(channel)) is not None:
                    self._limit(channel, torque=min(limits.torque, round(STALL_TORQUE * share)))

    def command_codes(self, codes: ArrayLike) -> None:
        """As `AeroHand.command_codes`, guarded; the first one is approached slowly."""
        goal = protocol.position_codes(codes)
        with self._guard.turn():
            self._start(goal)
            self._guard.command(goal)

    def command_codes_blindly(self, codes: ArrayLike) -> None:
        """As `command_codes`: a program commands nothing blindly; only the guard's last opening does."""
        self.command_codes(codes)

    def command_torques(self, magnitudes: ArrayLike) -> None:
        """As `AeroHand.command_torques`, guarded but for the encoders, which have no goal then."""
        goal = protocol.torque_magnitudes(magnitudes)
        with self._guard.turn():
            self._start()
            self._guard.command_torques(goal)

    read_codes = _polled(AeroHand.read_codes)
    read_currents = _polled(AeroHand.read_currents)
    read_temperatures = _polled(AeroHand.read_temperatures)
    read_speeds = _polled(AeroHand.read_speeds)
    knows = _polled(AeroHand.knows, protocol.make_refused)
    trim = _polled(AeroHand.trim, protocol.make_trim)
    set_id = _polled(AeroHand.set_id, protocol.make_set_id)
    resynchronise = _polled(AeroHand.resynchronise)

    def set_speed(self, channel: Channel, register_units: int) -> None:
        """As `AeroHand.set_speed`, and sent again after a restart; opens the hand first if nothing has moved yet.

        Raises:
            RefusedError: also where the firmware has no limits; nothing is sent then.
        """
        protocol.make_set_speed(channel, register_units)  # nonsense is refused before anything moves
        with self._guard.turn():
            self._limit(channel, speed=register_units)

    def set_torque(self, channel: Channel, register_units: int) -> None:
        """As `AeroHand.set_torque`; otherwise as `set_speed`."""
        protocol.make_set_torque(channel, register_units)
        with self._guard.turn():
            self._limit(channel, torque=register_units)

    def calibrate_mid(self, channel: Channel) -> Centred:
        """As `AeroHand.calibrate_mid`, at low speed and torque, from a hand that holds still.

        The hand holds where it stands afterwards, and the usual limits of the channel apply from the next command on.
        The watch restarts: what was commanded before meant other angles.

        Raises:
            ValueError, SafetyStopError, AeroError: as `begin` and `AeroHand.calibrate_mid`; the limits are restored.
        """
        channel = Channel(channel)
        with self._guard.turn():
            self._start()
            self._guard.poll()
            result = self._calibrate_mid(channel)
        _LOG.warning(
            "%s: %s reads %d counts where it stands. The same command means another angle from now on, and the finger "
            "may jump with the next one; approach it in small steps.",
            self.name, channel.label, result.position_counts,
        )  # fmt: skip
        return result

    def home(self, timeout_s: float = HOMING_TIMEOUT_S) -> None:
        """As `AeroHand.home`, from the open hand; it is checked before and not watched meanwhile.

        Closed fingers are opened slowly first: a thumb that lies against them would find its stop there, and all its
        angles would be wrong from then on.
        """
        positive_s("timeout_s", timeout_s)
        with self._guard.turn():
            if self.phase is Phase.MOVING:
                self._guard.poll()
                self._ramp(self._hand.read_codes(), OPEN)
                self._settle()
            self._start()
            self._guard.poll()
            self._hand.home(timeout_s)
            self._guard.pause(homed=True)

    def close(self) -> None:
        """Open the hand slowly and leave it weak, if this program has moved it, and close the port.

        Ctrl-C waits meanwhile. A second call does nothing, nor does one in a forked process.

        Raises:
            SafetyStopError: the hand may not be open; the message says what to do.
            LinkLostError: the same, because the link was lost.
        """
        self._guard.end()
        # It would keep a stopped hand for ever: the guard has the stop, whose traceback has the hand.
        self._finalizer.detach()

    def _start(self, goal: ArrayLike = OPEN) -> None:
        """Check a hand that has not moved yet, open it gently, see that it has opened, and go gently to a goal (7,).

        A start that an exception interrupted is made again from its beginning.
        """
        if self.phase is Phase.MOVING:
            return
        health = self.check()
        self._guard.begin()
        self._ramp(health.codes, OPEN)
        self._settle()
        self._expect_open()
        self._ramp(OPEN, goal)
        _LOG.info("%s: opened slowly, and watched from now on", self.name)
        self._guard.poll()
        self._guard.limits.weaken(())
        self._guard.phase = Phase.MOVING

    def _expect_open(self) -> None:
        shares = self._hand.read_codes() / MAX_CODE
        worst = Channel(int(np.argmax(shares)))
        if shares[worst] > self.thresholds.arrival:
            text = (
                f"{worst.label} is still {shares[worst]:.0%} closed after the hand was opened slowly: it is "
                "blocked, its servo has no torque, or its zero is lost; home the hand"
            )
            self._guard.abort(Violation(SafetyReason.STILL_CLOSED, text, worst))
        self._guard.found(shares)

    def _ramp(self, start_codes: ArrayLike, goal_codes: ArrayLike) -> None:
        """Move all channels slowly."""
        commands = self._guard.commands

        def command(codes: NDArray[np.int64]) -> None:
            nonlocal commands
            if self._guard.commands != commands:
                raise RuntimeError(f"{self.name}: a signal handler has commanded it during a slow motion")
            self._guard.command(codes)
            commands += 1

        move_slowly(command, self._own_clock, start_codes, goal_codes, self.thresholds.opening_s)

    def _settle(self) -> None:
        """Give encoders the time to arrive."""
        self._own_clock.sleep_until(self._clock.now() + self.thresholds.opening_s / 4)

    def _limit(self, channel: Channel, **changed: int) -> None:
        """Change a channel's `speed` or `torque`, register units; opens the hand first if nothing has moved yet.

        Raises:
            RefusedError: the firmware has no limits; nothing is sent.
        """
        if not self._guard.limits.settable:  # its board would be silent for a second, in which nothing watches the hand
            raise RefusedError(f"{self.name}: its firmware has no speed and torque limits. Nothing was sent.")
        self._start()
        for name, register_units in changed.items():
            self._guard.poll()
            self._guard.limits.change(channel, name, register_units)

    def _calibrate_mid(self, channel: Channel) -> Centred:
        before = self._guard.limits.of(channel)
        if before is None:
            return self._hand.calibrate_mid(channel)
        self._limit(channel, speed=self.thresholds.gentle_speed, torque=self.thresholds.gentle_torque)
        try:
            # The command ends torque mode, and the servo takes the limits with it.
            held = self._hand.read_codes() if self._guard.in_torque_mode else self._guard.last_codes
            self._guard.command(protocol.position_codes(held))
            self._guard.poll()
            result = self._hand.calibrate_mid(channel)
            self._guard.pause(homed=False)  # what was commanded meant other angles
            codes = self._guard.last_codes.copy()
            codes[channel] = result.code
            self._guard.command(codes)
        finally:
            self._limit(channel, speed=before.speed, torque=before.torque)
        return result
