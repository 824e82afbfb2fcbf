"""A hand that is watched while a program moves it."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero import protocol
from aero.acknowledgement import Centred
from aero.channels import THUMB, Channel
from aero.clock import Clock
from aero.driver import TELEMETRY_AGE_PRE_S, TELEMETRY_AGE_S, AeroHand
from aero.errors import AeroError
from aero.firmware import ServoSettings
from aero.protocol import MAX_CODE
from aero.safety.interrupts import uninterrupted
from aero.safety.lateness import Lateness
from aero.safety.opening import OPEN, SWITCH_OFF, move_slowly, open_and_relax
from aero.safety.reading import Reading
from aero.safety.standby import Standby
from aero.safety.state import Health, Phase
from aero.safety.stop import LinkLostError, SafetyStopError
from aero.safety.thresholds import Thresholds
from aero.safety.watch import Watch
from aero.safety.watched_clock import WatchedClock
from aero.transport import Transport

_LOG = logging.getLogger(__name__)
PROGRAM_ENDED, LINK_LOST = "The program ended", "The link was lost"
"""Why a hand is opened when nothing else was wrong."""
STALL_TORQUE = 1000
"""Torque limit that stands for the stall torque, register units (Feetech: tenths of a per cent)."""


class GuardedHand(AeroHand):
    """An `AeroHand` that starts gently, stops itself, and ends open and weak.

    Before the first motion it looks at currents and temperatures, then opens slowly at limited speed and torque. Only
    a hand whose encoders all arrive goes on, slowly to its first goal, and then gets its usual limits back. From then
    on every call, and every wait on `clock`, looks at currents, encoders and temperatures as often as `Thresholds`
    says. What breaks a threshold opens the hand slowly and raises `SafetyStopError`, then and at every later call.
    `close`, and with it the end of a `with` statement, opens it in any case. Limits belong to the guard's state: after
    a restart of the board, or any exchange that did not go as it should, they are sent again.

    Not for several threads, and only for the process that made it: a forked one is refused. While the board homes it
    answers nothing, so nothing is watched then.
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
            usual: the firmware's own limits, given back after the slow opening; None for a firmware that has no
                settings for them, whose start is slow in steps of position alone.
            thresholds: when to stop; the defaults when None.
            standby: the process that opens the hand should this one be killed; None for a hand in software.
        """
        super().__init__(transport, clock)
        self.thresholds = thresholds or Thresholds()
        self.phase = Phase.RESTING
        self.clock: Clock = WatchedClock(clock, self._permit, self.thresholds.look_s)
        """Wait on this one, so that the hand is watched meanwhile."""
        self._bare_clock = clock
        self._usual = usual
        self._standby = standby
        self._owner = os.getpid()
        self._acting = False
        self._limits: dict[Channel, ServoSettings] = {}
        self._disturbances = 0
        self._restarts = 0
        telemetry_s = TELEMETRY_AGE_PRE_S if usual is None else TELEMETRY_AGE_S
        self._watch = Watch(self.thresholds, spans_counts, telemetry_s)
        self._lateness = Lateness(self.thresholds.follow_s, self.thresholds.look_s)
        self._look_due = self._temperatures_due = self._looked_at = clock.now()
        self._last_codes: NDArray[np.integer] = np.array(OPEN)
        self._closed = False
        self._in_torque_mode = False
        self._is_open = True
        self._stop = ""

    def check(self) -> Health:
        """Read positions, currents and temperatures; moves nothing.

        Raises:
            SafetyStopError: a temperature or a current is over its limit before anything moves.
            AeroError, ConnectionError: as `read_codes`.
        """
        self._permit()
        with self._itself():
            health = Health(self.read_codes(), self.read_currents(), self.read_temperatures())
        objection = self._watch.temperatures(health.temperatures_c)
        most = int(np.argmax(np.abs(health.currents_a)))
        if objection is None and abs(health.currents_a[most]) > self.thresholds.current_a:
            objection = (
                f"{Channel(most).label} draws {abs(health.currents_a[most]):.1f} A at rest (limit "
                f"{self.thresholds.current_a:g} A): it holds against something; take it out, or open the hand by hand"
            )
        if objection is not None:
            raise SafetyStopError(f"{self.name}: not moved. {objection}.")
        return health

    def begin(self) -> None:
        """Check the hand and open it gently now, if nothing has moved yet, and not in the middle of the first command.

        Call it where the time of the first command matters.

        Raises:
            SafetyStopError: as `check`; or the hand did not open.
        """
        if self.phase is Phase.RESTING:
            self._start(np.array(OPEN))

    def expect_stops(self, channels: Iterable[Channel]) -> None:
        """Weaken channels that are about to be driven into their stops, which is no reason to stop the hand then.

        The others get their usual limits; the thumb's channels are always weakened. Nothing happens with a firmware
        that has no torque settings. The board applies it with the next command.

        Raises:
            SafetyStopError, AeroError: as `begin` and `set_torque`.
        """
        self.begin()
        self._permit()
        if self._usual is not None:
            weak = {*THUMB, *channels}
            for channel in Channel:
                torque = min(self._usual.torque, self.thresholds.stop_torque) if channel in weak else self._usual.torque
                self._limits[channel] = ServoSettings(self._usual.speed, torque)
            self._send_limits()

    def limit_torques(self, share: float) -> None:
        """Let no channel use more than a share (0..1) of its stall torque; `expect_stops` ends it.

        Channels whose limit is lower keep it. Nothing happens with a firmware that has no torque settings. The board
        applies it with the next command.

        Raises:
            SafetyStopError, AeroError: as `begin` and `set_torque`.
        """
        self.expect_stops(())
        if self._usual is not None:
            for channel in Channel:
                most = self.thresholds.stop_torque if channel in THUMB else self._usual.torque
                self.set_torque(channel, min(most, round(STALL_TORQUE * share)))

    def command_codes(self, codes: ArrayLike) -> None:
        """As `AeroHand.command_codes`, guarded; the first one is approached slowly."""
        codes = np.asarray(codes)
        if self.phase is Phase.RESTING:
            protocol.make_positions(codes)
            self._start(codes)
        super().command_codes(codes)
        if self.phase is not Phase.ENDING:
            self._last_codes = codes
            self._in_torque_mode = False
            self._closed = bool((codes > self.thresholds.arrival * MAX_CODE).any())
            self._watch.encoders.commanded(self._bare_clock.now(), self._last_codes / MAX_CODE)

    def command_codes_blindly(self, codes: ArrayLike) -> None:
        """As `command_codes`, guarded; only the last opening is sent to a board that may be out of step."""
        if self.phase is Phase.ENDING:
            super().command_codes_blindly(codes)
        else:
            self.command_codes(codes)

    def command_torques(self, magnitudes: ArrayLike) -> None:
        """As `AeroHand.command_torques`, guarded but for the encoders, which have no goal then."""
        magnitudes = np.asarray(magnitudes)
        protocol.make_torques(magnitudes)
        if self.phase is not Phase.ENDING:
            self.begin()
            self._permit()
            self._watch.encoders.forget()
            self._closed = self._in_torque_mode = True
        super().command_torques(magnitudes)

    def set_speed(self, channel: Channel, register_units: int) -> None:
        """As `AeroHand.set_speed`, and sent again after a restart; opens the hand first if nothing has moved yet."""
        self._set_limit(channel, "speed", register_units)

    def set_torque(self, channel: Channel, register_units: int) -> None:
        """As `AeroHand.set_torque`, and sent again after a restart; opens the hand first if nothing has moved yet."""
        self._set_limit(channel, "torque", register_units)

    def calibrate_mid(self, channel: Channel) -> Centred:
        """As `AeroHand.calibrate_mid`, at low speed and torque, from a hand that holds still.

        The hand holds where it stands afterwards, and the usual limits of the channel apply from the next command on.
        The watch starts anew: what was commanded before meant other angles.

        Raises:
            SafetyStopError, AeroError: as `begin` and `AeroHand.calibrate_mid`; the limits are given back.
        """
        self.begin()
        if channel not in self._limits:
            return super().calibrate_mid(channel)
        before = self._limits[channel]
        self.set_speed(channel, self.thresholds.gentle_speed)
        self.set_torque(channel, self.thresholds.gentle_torque)
        try:
            # The command ends torque mode, and the servo takes the limits with it.
            self.command_codes(self.read_codes() if self._in_torque_mode else self._last_codes)
            result = super().calibrate_mid(channel)
            self._watch.pause()
            codes = self._last_codes.copy()
            codes[channel] = result.code
            self.command_codes(codes)
        finally:
            self.set_speed(channel, before.speed)
            self.set_torque(channel, before.torque)
        _LOG.warning(
            "%s: %s reads %d counts where it stands. The same command means another angle from now on, and the finger "
            "may jump with the next one; approach it in small steps.",
            self.name, channel.label, result.position_counts,
        )  # fmt: skip
        return result

    def home(self, timeout_s: float = 200.0) -> None:
        """As `AeroHand.home`, from the open hand; it is checked before and not watched meanwhile.

        Closed fingers are opened slowly first: a thumb that lies against them would find its stop there, and all its
        angles would be wrong from then on.
        """
        if self.phase is Phase.MOVING:
            move_slowly(self, self.clock, self.read_codes(), OPEN, self.thresholds.opening_s)
            self.clock.sleep_until(self._bare_clock.now() + self.thresholds.opening_s / 4)
        self.begin()
        super().home(timeout_s)
        self._watch.pause()
        self._look_due = self._looked_at = self._bare_clock.now()

    def close(self) -> None:
        """Open the hand slowly and leave it weak, if this program has moved it, and give the port back.

        Ctrl-C waits meanwhile. A second call does nothing, nor does one in a forked process.

        Raises:
            SafetyStopError: the hand may not be open; the message says what to do.
            LinkLostError: the same, because the link was lost.
        """
        if os.getpid() != self._owner:
            return
        standby, self._standby = self._standby, None
        try:
            if self.phase in {Phase.OPENING, Phase.MOVING}:
                self._open(PROGRAM_ENDED)
        finally:
            super().close()
            if standby is not None:
                (standby.stand_down if self._is_open else standby.take_over)()

    def _start(self, goal: NDArray[np.integer]) -> None:
        """Check the hand, open it gently, see that it has opened, and go gently to the first goal."""
        health = self.check()
        if self._standby is not None:
            self._standby.start()
        self.phase, self._is_open = Phase.OPENING, False
        self._disturbances, self._restarts = self._link.disturbances, self._link.restarts
        if self._usual is not None:
            self._limits = dict.fromkeys(
                Channel, ServoSettings(self.thresholds.gentle_speed, self.thresholds.gentle_torque)
            )
            self._send_limits()
        move_slowly(self, self.clock, health.codes, OPEN, self.thresholds.opening_s)
        self.clock.sleep_until(self._bare_clock.now() + self.thresholds.opening_s / 4)
        self._expect_open()
        move_slowly(self, self.clock, OPEN, goal, self.thresholds.opening_s)
        self.phase = Phase.MOVING
        self.expect_stops(())

    def _expect_open(self) -> None:
        with self._itself():
            shares = self.read_codes() / MAX_CODE
        worst = int(np.argmax(shares))
        if shares[worst] > self.thresholds.arrival:
            self._abort(
                f"{Channel(worst).label} is still {shares[worst]:.0%} closed after the hand was opened slowly: it is "
                "blocked, its servo has no torque, or its zero is lost; home the hand"
            )
        self._watch.encoders.found(self._bare_clock.now(), shares)

    def _set_limit(self, channel: Channel, what: str, register_units: int) -> None:
        if self.phase is not Phase.ENDING:
            self.begin()
        (super().set_speed if what == "speed" else super().set_torque)(channel, register_units)
        if self._usual is not None and self.phase is not Phase.ENDING:
            self._limits[channel] = replace(self._limits[channel], **{what: register_units})

    def _send_limits(self) -> None:
        """Send all limits that the guard holds, whatever the board has."""
        with self._itself():
            for channel, settings in self._limits.items():
                super().set_speed(channel, settings.speed)
                super().set_torque(channel, settings.torque)

    @contextmanager
    def _itself(self) -> Iterator[None]:
        """Let exchanges pass that are the guard's own."""
        before, self._acting = self._acting, True
        try:
            yield
        finally:
            self._acting = before

    def _permit(self) -> None:
        """Look at the hand if it is time; nothing happens before the first motion."""
        if os.getpid() != self._owner:
            raise SafetyStopError(f"{self.name}: this process was forked; the hand belongs to the one that opened it.")
        if self._acting:
            return
        if self.phase is Phase.STOPPED:
            raise SafetyStopError(self._stop)
        now = self._bare_clock.now()
        if self.phase not in {Phase.OPENING, Phase.MOVING} or now < self._look_due:
            return
        silent = False
        if self._link.silent_from is None:  # else the program has waited for the board
            # What the look before took makes this one not late.
            self._lateness.began(now, now - max(self._look_due, self._looked_at + self.thresholds.look_s))
        try:
            with self._itself():
                objection = self._unwatched(now) or self._look()
                self._lateness.answered(self._bare_clock.now(), self._bare_clock.now() - now)
                self._restore()
        except AeroError:
            # What the program itself has asked in vain counts too.
            asked = now if self._link.silent_from is None else min(now, self._link.silent_from)
            objection = self._watch.unanswered(asked, self._bare_clock.now())
            silent = True
        self._looked_at = self._bare_clock.now()
        self._look_due = now + self.thresholds.look_s
        if objection is not None:
            self._abort(objection, silent=silent)

    def _unwatched(self, now: float) -> str | None:
        """Return why to stop when nobody has looked at a hand that is not open for too long."""
        unwatched_s = now - self._looked_at
        if not self._closed or unwatched_s <= self.thresholds.unwatched_s:
            return None
        return (
            f"nobody has looked at the hand for {unwatched_s:.0f} s (limit {self.thresholds.unwatched_s:g} s): this "
            "machine was suspended, or the program was stopped or did not call; wait on the hand's clock"
        )

    def _look(self) -> str | None:
        asked, codes = self._bare_clock.now(), self.read_codes()
        reading = Reading(asked, self._bare_clock.now(), codes / MAX_CODE)
        objection = self._watch.look(reading, self.read_currents())
        if objection is None and reading.replied >= self._temperatures_due:
            self._temperatures_due = reading.replied + self.thresholds.temperature_look_s
            objection = self._watch.temperatures(self.read_temperatures())
        return objection

    def _restore(self) -> None:
        """Send the limits again when the board may have lost them, and what makes it apply them when it has."""
        disturbances, restarts = self._link.disturbances, self._link.restarts
        if disturbances == self._disturbances:
            return
        self._send_limits()
        if restarts != self._restarts:
            super().command_codes(self._last_codes)
        self._disturbances, self._restarts = disturbances, restarts

    def _abort(self, objection: str, *, silent: bool = False) -> None:
        self._open(objection + self._lateness.remark(), silent=silent)
        raise SafetyStopError(self._stop)

    def _open(self, reason: str, *, silent: bool = False) -> None:
        """Open slowly and leave weak; the hand takes no more commands of the program.

        A board that was just found `silent` is not asked first where its hand stands.

        A signal that comes meanwhile is carried out afterwards, but for a hand that may be closed.

        Raises:
            SafetyStopError: the hand may not be open; this has to be said, whatever the signal was.
            LinkLostError: the same, because the link was lost, and nothing else was wrong.
        """
        self.phase = Phase.ENDING
        kind: type[SafetyStopError] = SafetyStopError
        with uninterrupted():
            try:
                with self._itself():
                    settable = self._usual is not None
                    doubt = open_and_relax(
                        self,
                        self._bare_clock,
                        self.thresholds,
                        settable=settable,
                        last_codes=self._last_codes,
                        silent=silent,
                    )
            except ConnectionError as error:
                doubt = str(error)
                if reason == PROGRAM_ENDED:
                    reason, kind = LINK_LOST, LinkLostError
            finally:
                self.phase = Phase.STOPPED
            self._is_open = not doubt
            done = "stopped and opened slowly" if self._is_open else "stopped"
            self._stop = f"{self.name}: {done}. {reason}."
            if doubt:
                self._stop += f" {SWITCH_OFF}, because {doubt}"
                raise kind(self._stop)
