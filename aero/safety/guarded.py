"""A hand that is watched while a program moves it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero import protocol
from aero.channels import Channel
from aero.clock import Clock
from aero.driver import TELEMETRY_AGE_PRE_S, TELEMETRY_AGE_S, AeroHand
from aero.errors import AeroError
from aero.protocol import MAX_CODE
from aero.safety.errors import SafetyStopError
from aero.safety.interrupts import uninterrupted
from aero.safety.lateness import Lateness
from aero.safety.opening import OPEN, limit, move_slowly, open_and_relax
from aero.safety.reading import Reading
from aero.safety.thresholds import Settings, Thresholds
from aero.safety.watch import Watch
from aero.safety.watched_clock import WatchedClock
from aero.transport import Transport

Floats = NDArray[np.float64]

STALL_TORQUE = 1000
"""Torque limit that stands for the stall torque, register units (Feetech: tenths of a per cent)."""
THUMB = (Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)


@dataclass(frozen=True)
class Health:
    """What a hand says about itself while nothing moves, arrays (7,) in command order."""

    codes: NDArray[np.uint16]
    currents_a: Floats
    temperatures_c: Floats


class Phase(Enum):
    """Where a guarded hand is."""

    RESTING = "nothing has moved yet"
    OPENING = "it opens and approaches its first goal slowly, with limited speed and torque"
    MOVING = "the program moves it"
    ENDING = "it opens slowly for the last time"
    STOPPED = "it was opened and takes no more commands"


class GuardedHand(AeroHand):
    """An `AeroHand` that starts gently, stops itself, and ends open and weak.

    Before the first motion it looks at currents and temperatures, then opens slowly at limited speed and torque. Only
    a hand whose encoders all arrive goes on, slowly to its first goal, and then gets its usual limits back. From then
    on every call, and every wait on `clock`, looks at currents, encoders and temperatures as often as `Thresholds`
    says. What breaks a threshold opens the hand slowly and raises `SafetyStopError`, then and at every later call.
    `close`, and with it the end of a `with` statement, opens it in any case.

    Not for several threads. While the board homes it answers nothing, so nothing is watched then.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        *,
        spans_counts: ArrayLike,
        usual: Settings | None,
        thresholds: Thresholds | None = None,
        on_first_motion: Callable[[], None] = lambda: None,
    ) -> None:
        """Wrap an open transport.

        Args:
            transport: the bytes' way to the board.
            clock: what tells the time and is waited on.
            spans_counts: (7,) servo counts of the channels' command windows, `CommandWindow.spans_counts()`.
            usual: the firmware's own limits, given back after the slow opening; None for a firmware that has no
                settings for them, whose start is slow in steps of position alone.
            thresholds: when to stop; the defaults when None.
            on_first_motion: called once before anything moves.
        """
        super().__init__(transport, clock)
        self.thresholds = thresholds or Thresholds()
        self.phase = Phase.RESTING
        self.clock: Clock = WatchedClock(clock, self._look_if_due, self.thresholds.look_s)
        """Wait on this one, so that the hand is watched meanwhile."""
        self._bare_clock = clock
        self._usual = usual
        self._on_first_motion = on_first_motion
        telemetry_s = TELEMETRY_AGE_PRE_S if usual is None else TELEMETRY_AGE_S
        self._watch = Watch(self.thresholds, spans_counts, telemetry_s)
        self._lateness = Lateness(self.thresholds.follow_s)
        self._look_due = self._temperatures_due = clock.now()
        self._last_codes: NDArray[np.integer] = np.array(OPEN)
        self._stop = ""

    def check(self) -> Health:
        """Read positions, currents and temperatures; moves nothing.

        Raises:
            SafetyStopError: a temperature or a current is over its limit before anything moves.
            AeroError, ConnectionError: as `read_codes`.
        """
        health = Health(super().read_codes(), super().read_currents(), super().read_temperatures())
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
        self._look_if_due()
        if self._usual is not None:
            weak = {*THUMB, *channels}
            limit(self, self._usual)
            for channel in weak:
                self.set_torque(channel, min(self._usual.torque, self.thresholds.stop_torque))

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
        self._look_if_due()
        super().command_codes(codes)
        self._last_codes = codes
        self._watch.encoders.commanded(self._bare_clock.now(), self._last_codes / MAX_CODE)

    def command_torques(self, magnitudes: ArrayLike) -> None:
        """As `AeroHand.command_torques`, guarded but for the encoders, which have no goal then."""
        self.begin()
        self._look_if_due()
        self._watch.encoders.forget()
        super().command_torques(magnitudes)

    def home(self, timeout_s: float = 200.0) -> None:
        """As `AeroHand.home`; the hand is checked before and not watched meanwhile."""
        self.begin()
        self._look_if_due()
        super().home(timeout_s)
        self._watch.pause()
        self._look_due = self._bare_clock.now()

    def read_codes(self) -> NDArray[np.uint16]:
        """As `AeroHand.read_codes`, guarded."""
        self._look_if_due()
        return super().read_codes()

    def close(self) -> None:
        """Open the hand slowly and leave it weak, if this program has moved it, and give the port back.

        Ctrl-C waits meanwhile. A second call does nothing.

        Raises:
            SafetyStopError: the hand could not be reached; the message says what to do.
        """
        try:
            if self.phase in {Phase.OPENING, Phase.MOVING}:
                self._open("The program ended")
        finally:
            super().close()

    def _start(self, goal: NDArray[np.integer]) -> None:
        """Check the hand, open it gently, see that it has opened, and go gently to the first goal."""
        health = self.check()
        self._on_first_motion()
        self.phase = Phase.OPENING
        if self._usual is not None:
            limit(self, Settings(self.thresholds.gentle_speed, self.thresholds.gentle_torque))
        move_slowly(self, self.clock, health.codes, OPEN, self.thresholds.opening_s)
        self.clock.sleep_until(self._bare_clock.now() + self.thresholds.opening_s / 4)
        self._expect_open()
        move_slowly(self, self.clock, OPEN, goal, self.thresholds.opening_s)
        self.phase = Phase.MOVING
        self.expect_stops(())

    def _expect_open(self) -> None:
        shares = super().read_codes() / MAX_CODE
        worst = int(np.argmax(shares))
        if shares[worst] > self.thresholds.arrival:
            self._abort(
                f"{Channel(worst).label} is still {shares[worst]:.0%} closed after the hand was opened slowly: it is "
                "blocked, its servo has no torque, or its zero is lost; home the hand"
            )
        self._watch.encoders.found(self._bare_clock.now(), shares)

    def _look_if_due(self) -> None:
        """Look at the hand if it is time; nothing happens before the first motion."""
        if self.phase is Phase.STOPPED:
            raise SafetyStopError(self._stop)
        now = self._bare_clock.now()
        if self.phase not in {Phase.OPENING, Phase.MOVING} or now < self._look_due:
            return
        try:
            objection = self._look()
        except AeroError:
            objection = self._watch.unanswered(now, self._bare_clock.now())
        self._lateness.note(self._bare_clock.now(), self._bare_clock.now() - self._look_due)
        self._look_due = now + self.thresholds.look_s
        if objection is not None:
            self._abort(objection)

    def _look(self) -> str | None:
        asked, codes = self._bare_clock.now(), super().read_codes()
        reading = Reading(asked, self._bare_clock.now(), codes / MAX_CODE)
        objection = self._watch.look(reading, super().read_currents())
        if objection is None and reading.replied >= self._temperatures_due:
            self._temperatures_due = reading.replied + self.thresholds.temperature_look_s
            objection = self._watch.temperatures(super().read_temperatures())
        return objection

    def _abort(self, objection: str) -> None:
        self._open(objection + self._lateness.remark())
        raise SafetyStopError(self._stop)

    def _open(self, reason: str) -> None:
        """Open slowly and leave weak; the hand takes no more commands of the program."""
        self.phase = Phase.ENDING
        self._stop = f"{self.name}: stopped and opened slowly. {reason}."
        try:
            with uninterrupted():
                open_and_relax(
                    self,
                    self._bare_clock,
                    self.thresholds,
                    settable=self._usual is not None,
                    last_codes=self._last_codes,
                )
        except (AeroError, ConnectionError) as error:
            self._stop = f"{self.name}: {reason}. The hand could not be opened: switch it off. ({error})"
            raise SafetyStopError(self._stop) from error
        finally:
            self.phase = Phase.STOPPED
