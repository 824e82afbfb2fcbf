"""Guarded hand: driver calls with a guard's polls and limits."""

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
from aero.safety.cooling import let_cool
from aero.safety.guard import Guard
from aero.safety.opening import OPEN, move_slowly
from aero.safety.standby import Standby
from aero.safety.stop import Health, Phase, SafetyReason, SafetyStopError, Violation
from aero.safety.thresholds import Thresholds
from aero.safety.watchdog import WatchedClock
from aero.transport import Transport

_LOG = logging.getLogger(__name__)
STALL_TORQUE = 1000
"""Torque limit equal to the stall torque, register units (Feetech: tenths of a per cent)."""

P = ParamSpec("P")
T = TypeVar("T")


def _polled(
    call: Callable[Concatenate[AeroHand, P], T], check: Callable[P, object] | None = None
) -> Callable[Concatenate[GuardedHand, P], T]:
    """Return a driver call as a method of the guarded hand, with a poll before it.

    `check` takes the arguments of `call` and raises for invalid ones before any frame, even a poll's.
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
    """Hand with gentle start, automatic stop, and slow opening at the end.

    Before the first motion, currents and temperatures are checked and the hand opens slowly at limited speed and
    torque. If all encoders arrive, the hand moves slowly to its first goal, and the firmware's limits are restored.
    From then on every call, and every wait on `clock`, polls currents, encoders and temperatures at the periods in
    `Thresholds`. A violation opens the hand slowly and raises `SafetyStopError`, also in every later call. `close`, or
    the end of a `with` statement, always opens it. The guard sends servo limits again after a restart of the board or
    a failed exchange.

    Threads may share a hand: each call is atomic. Forked processes are refused. During homing the hand is not polled,
    because the board does not answer.
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
            transport: byte stream to the board.
            clock: clock for time and waits.
            spans_counts: (7,) servo counts of the channels' command windows, `CommandWindow.spans_counts()`.
            usual: the firmware's limits, restored after the slow opening; None for a firmware without settable limits,
                whose slow start relies on small position steps.
            thresholds: stop criteria; None for the defaults.
            standby: process that opens the hand if this one is killed; None for an emulated hand.
        """
        self.thresholds = thresholds or Thresholds()
        """Stop criteria."""
        self._hand = AeroHand(transport, clock, PATIENCE_S)  # the guard opens a hand after 1 s of silence
        super().__init__(self._hand._link, clock)
        self._guard = guard = Guard(
            self._hand, clock, spans_counts=spans_counts, usual=usual, thresholds=self.thresholds, standby=standby
        )
        self._own_clock = WatchedClock(clock, guard.poll, self.thresholds.look_s)
        self.clock: Clock = WatchedClock(clock, guard.poll_alone, self.thresholds.look_s)
        """Clock for the program's waits; polls the hand meanwhile."""
        # For a program that never calls `close`, and for an interrupt at the very beginning of `close`.
        self._finalizer = weakref.finalize(self, self._guard.end)

    @property
    def phase(self) -> Phase:
        """Phase of the guard."""
        return self._guard.phase

    def check(self) -> Health:
        """Read and check positions, currents and temperatures, without motion.

        Raises:
            SafetyStopError: a temperature or a current above its threshold.
            AeroError, ConnectionError: as `read_codes`.
        """
        with self._guard.turn():
            self._guard.poll()
            health = Health(self._hand.read_codes(), self._hand.read_currents(), self._hand.read_temperatures())
        self._guard.lookout.gate.seen(health.codes)
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
        """Check the hand and open it gently now instead of within the first command; only before the first motion.

        Call this method if the time of the first command matters.

        Raises:
            SafetyStopError: as `check`; or the hand did not open.
        """
        with self._guard.turn():
            self._start()

    def expect_stops(self, channels: Iterable[Channel]) -> None:
        """Lower the torque limits of channels that will be driven into their end stops, so that the guard allows it.

        The other channels get their usual limits; the thumb's limits are always lowered. Without settable torque
        limits this does nothing. The board applies limits with the next command.

        Raises:
            ValueError: unknown channel; nothing is sent.
            SafetyStopError, AeroError: as `begin` and `set_torque`.
        """
        weak = tuple(map(Channel, channels))
        with self._guard.turn():
            self._start()
            self._guard.poll()
            self._guard.limits.weaken(weak)

    def limit_torques(self, share: float) -> None:
        """Limit the torque of all channels to a fraction (0..1) of the stall torque, until `expect_stops`.

        Lower limits are kept. Without settable torque limits this does nothing. The board applies limits with the next
        command.

        Raises:
            ValueError: fraction out of range; nothing is sent.
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
        """As `AeroHand.command_codes`, guarded; the first goal is approached slowly."""
        goal = protocol.position_codes(codes)
        with self._guard.turn():
            self._start(goal)
            self._guard.command(goal)

    def command_codes_blindly(self, codes: ArrayLike) -> None:
        """As `command_codes`; only the guard's final opening commands blindly."""
        self.command_codes(codes)

    def command_torques(self, magnitudes: ArrayLike) -> None:
        """As `AeroHand.command_torques`, guarded except for the encoders, which have no goal in torque mode."""
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
        """As `AeroHand.set_speed`, and sent again after a restart; opens the hand first if it has not moved yet.

        Raises:
            RefusedError: also for a firmware without limits; nothing is sent.
        """
        protocol.make_set_speed(channel, register_units)  # raises for invalid values before any motion
        with self._guard.turn():
            self._limit(channel, speed=register_units)

    def set_torque(self, channel: Channel, register_units: int) -> None:
        """As `AeroHand.set_torque`; otherwise as `set_speed`."""
        protocol.make_set_torque(channel, register_units)
        with self._guard.turn():
            self._limit(channel, torque=register_units)

    def calibrate_mid(self, channel: Channel) -> Centred:
        """As `AeroHand.calibrate_mid`, at low speed and torque, while the hand holds its position.

        Afterwards the hand holds its position, and the channel's previous limits apply with the next command. The
        encoder checks restart, because earlier codes meant other angles.

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
        """As `AeroHand.home`, from the open hand; checked before, not polled during homing.

        Closed fingers are opened slowly first: a thumb homed against a finger would get a wrong zero. Servos that the
        homing has heated cool down before the next poll.
        """
        positive_s("timeout_s", timeout_s)
        with self._guard.turn():
            if self.phase is Phase.MOVING:
                self._guard.poll()
                self._ramp(self._hand.read_codes(), OPEN)
                self._settle()
            self._start()
            self._guard.poll()
            with self._guard.homing(timeout_s):
                self._hand.home(timeout_s)
                let_cool(self._hand.read_temperatures, self._own_clock.bare)

    def close(self) -> None:
        """Open the hand slowly and limit its torque, if this program has moved it, and close the port.

        Ctrl-C is deferred meanwhile. A second call, or a call in a forked process, does nothing.

        Raises:
            SafetyStopError: the hand may not be open; the message has a remedy.
            LinkLostError: the hand may not be open because the link was lost.
        """
        self._guard.end()
        # The finalizer would keep a stopped hand alive: the guard has the stop, whose traceback refers to the hand.
        self._finalizer.detach()

    def _start(self, goal: ArrayLike = OPEN) -> None:
        """Check a hand before its first motion, open it gently, verify that, and ramp gently to a goal (7,).

        After an exception the next call restarts from the beginning.
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
        beyond = shares - self._guard.lookout.gate.outcome(OPEN) / MAX_CODE
        worst = Channel(int(np.argmax(beyond)))
        if beyond[worst] > self.thresholds.arrival:
            text = (
                f"{worst.label} is still {shares[worst]:.0%} closed after the hand was opened slowly: it is "
                "blocked, its servo has no torque, or its zero is lost; home the hand"
            )
            self._guard.abort(Violation(SafetyReason.STILL_CLOSED, text, worst))
        self._guard.found(shares)

    def _ramp(self, start_codes: ArrayLike, goal_codes: ArrayLike) -> None:
        commands = self._guard.commands

        def command(codes: NDArray[np.int64]) -> None:
            nonlocal commands
            if self._guard.commands != commands:
                raise RuntimeError(f"{self.name}: a signal handler has commanded it during a slow motion")
            self._guard.command(codes)
            commands += 1

        move_slowly(command, self._own_clock, start_codes, goal_codes, self.thresholds.opening_s)

    def _settle(self) -> None:
        self._own_clock.sleep_until(self._clock.now() + self.thresholds.opening_s / 4)

    def _limit(self, channel: Channel, **changed: int) -> None:
        """Change a channel's `speed` or `torque`, register units; opens the hand first if it has not moved yet.

        Raises:
            RefusedError: the firmware has no limits; nothing is sent.
        """
        if not self._guard.limits.settable:  # a request would time out after 1 s, with the hand unwatched
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
            # The command ends torque mode and applies the limits.
            held = self._hand.read_codes() if self._guard.in_torque_mode else self._guard.last_codes
            self._guard.command(protocol.position_codes(held))
            self._guard.poll()
            result = self._hand.calibrate_mid(channel)
            self._guard.pause()  # earlier codes meant other angles
            codes = self._guard.last_codes.copy()
            codes[channel] = result.code
            self._guard.command(codes)
        finally:
            self._limit(channel, speed=before.speed, torque=before.torque)
        return result
