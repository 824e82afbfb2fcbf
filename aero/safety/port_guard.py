"""Guard of a port: passes a client's bytes to a hand while it is well, and opens the hand when something is wrong.

Theory of operation
===================

The client is any program: it takes the port for the hand's own. Its frames pass unchanged, and the guard's queries go
between them. Three states decide about its commands; its queries always pass, except while the hand is opened.

passing: commands pass. A violation of the thresholds, or the end or the silence of a client that left the hand closed,
    leads to opening.
opening: the hand opens slowly, as at the end of a guarded program; all frames of the client are dropped. It is repeated
    until the hand is open, also after the port was gone.
refusing: the hand is open and weak, and takes no command until `resume`.

One thread does it all. Whatever the guard waits for, the shared port passes bytes on meanwhile.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel
from aero.clock import Clock
from aero.driver import HOMING_TIMEOUT_S, TELEMETRY_AGE_PRE_S, TELEMETRY_AGE_S, AeroHand
from aero.errors import AeroError
from aero.firmware import ServoSettings
from aero.floats import Floats
from aero.link import PATIENCE_S
from aero.protocol import MAX_CODE, READINGS, Opcode, make_positions, parse_reply, unsigned_values
from aero.relay import GuardedLine
from aero.safety.heat import HeatWatch
from aero.safety.opening import OPEN, SWITCH_OFF, open_and_relax
from aero.safety.shared_port import SharedPort
from aero.safety.stop import SafetyReason, Violation
from aero.safety.thresholds import Thresholds
from aero.safety.watch import Lookout, Stop

_LOG = logging.getLogger(__name__)
PIECE_S = 0.02
"""Longest wait between two looks at signals, client and hand, s."""
CLIENT_S = 0.1
"""Period of looks for a client, s."""
GONE_S = 0.5
"""Time for which a port without a client is left alone, s: some programs open it twice in a row."""
RETRY_S = 0.1
WARNED_S = (60.0, 30.0, 10.0)
"""Times left for a grip at which the user is warned, s."""
REDEFINES = frozenset({Opcode.HOMING, Opcode.TRIM, Opcode.CALIBRATE_MID, Opcode.SET_ID})
"""Requests after which codes mean other positions."""


class PortState(Enum):
    """State of a guarded port."""

    PASSING = auto()
    OPENING = auto()
    REFUSING = auto()


@dataclass(frozen=True)
class PortStop:
    """Stop of a guarded port."""

    violation: Violation
    doubt: str | None
    """Reason why the hand may not be open; None for an open hand."""

    @property
    def text(self) -> str:
        """Message for the user."""
        if self.doubt is None:
            return f"stopped and opened slowly. {self.violation.text}. Commands are refused until `resume`"
        return f"stopped. {self.violation.text}. {SWITCH_OFF}, because {self.doubt}"


@dataclass(frozen=True)
class GuardedKind:
    """Properties of the hand on a guarded port."""

    spans_counts: ArrayLike
    """(7,) servo counts of the channels' command windows."""
    usual: ServoSettings | None
    """Limits of the firmware, set on `resume`; None for a firmware without settable limits."""
    thresholds: Thresholds


class PortGuard:
    """State machine between a client and a hand."""

    def __init__(
        self,
        connect: Callable[[], GuardedLine],
        clock: Clock,
        kind: GuardedKind,
        *,
        name: str,
        has_client: Callable[[], bool | None] = lambda: None,
        stopped: Callable[[PortStop], object] = lambda _stop: None,
        said: Callable[[str], object] = lambda _text: None,
        resumes_alone: bool = False,
    ) -> None:
        """Store the arguments; `run` opens the port.

        Args:
            connect: opens the line to the hand; raises `ConnectionError` while the port is gone.
            clock: clock of the hand.
            kind: properties of the hand.
            name: display name of the port.
            has_client: returns whether a program has the client's port open, None if the system does not tell.
            stopped: called after each stop, with the hand open or not.
            said: called with a sentence for the user.
            resumes_alone: True to resume with the next client instead of by `resume`.
        """
        self.state = PortState.PASSING
        self.refused = 0
        """Number of commands of clients that were refused."""
        self.listeners: list[Callable[[bool, bytes], None]] = []
        """Called with True and bytes to the hand, with False and bytes from it."""
        self._connect, self._clock, self._kind, self._name = connect, clock, kind, name
        self._has_client, self._stopped, self._said = has_client, stopped, said
        self._resumes_alone = resumes_alone
        self._port: SharedPort | None = None
        self._owed: Violation | None = None
        self._told: Violation | None = None
        self._lost = False
        self._asked_to_resume = False
        self._goal: NDArray[np.int64] | None = None
        self._moved = self._in_torque_mode = False
        self._homes_by = -math.inf
        self._heard = self._present = clock.now()
        self._client: bool | None = None
        self._client_due = clock.now()
        self._heat = HeatWatch(kind.thresholds.temperature_c)
        self._heat_at = -math.inf
        self._celsius: Floats | None = None
        self._warned_s = math.inf
        """Time left at the latest warning, s."""

    def run(self, stop: Callable[[], bool]) -> bool:
        """Pass bytes on until `stop()` is true; open a closed hand then, and return whether it is open.

        Raises:
            ConnectionError: the port cannot be opened at the start.
        """
        if self._port is None:
            self.open()
        self._lookout.pause()
        while not stop():
            try:
                self._turn()
            except ConnectionError as error:
                self._detach(error)
        return self._end()

    def resume(self) -> None:
        """Accept commands again, after a check of the hand at the next turn; no effect unless they are refused now."""
        self._asked_to_resume = self.state is PortState.REFUSING

    @property
    def closed(self) -> bool:
        """True if a client has moved the hand and may have left it closed."""
        if not self._moved or self._in_torque_mode:
            return self._moved
        pose = self._lookout.codes if self._goal is None else self._goal
        beyond = pose - self._lookout.gate.outcome(OPEN)
        return bool((beyond > self._kind.thresholds.arrival * MAX_CODE).any())

    def status(self) -> str:
        """Return state, refused commands, and the time for which this grip can be held."""
        grip = self._heat.grip()
        refused = f", {self.refused} commands refused" if self.refused else ""
        return f"{self.state.name.lower()}{refused}{'' if grip is None else f'; {grip}'}"

    def open(self) -> None:
        """Open the port; `run` does so too.

        Raises:
            ConnectionError: the port cannot be opened.
        """
        line = self._connect()
        self._port = port = SharedPort(line, self._clock, self._name, self._screen)
        port.listeners = self.listeners
        self._hand = AeroHand(port.guards_end, port.guards_end, PATIENCE_S)
        kind = self._kind
        age_s = TELEMETRY_AGE_PRE_S if kind.usual is None else TELEMETRY_AGE_S
        self._lookout = Lookout(self._hand, port.guards_end, kind.thresholds, kind.spans_counts, age_s)
        self._restarts = 0

    def _detach(self, error: ConnectionError) -> None:
        if not self._lost:
            self._lost = True
            self._said(f"the port is gone, and tried again: {error}")
        if self.state is PortState.PASSING and self.closed:
            self._owe(Violation(SafetyReason.LINK_LOST, "The link was lost while the hand was closed"))
        if self._port is not None:
            self._port.close()
            self._port = None

    def _turn(self) -> None:
        if self._port is None:
            self._clock.sleep_until(self._clock.now() + RETRY_S)
            self.open()
        port = self._alive()
        now = self._clock.now()
        polls = self.state is PortState.PASSING and not self._homing()
        port.pump(min(now + PIECE_S, max(self._lookout.due, now)) if polls else now + PIECE_S)
        self._look_for_client(port)
        if self._owed is None and (stop := self._stop()) is not None:
            self._owe(stop.violation._replace(text=stop.violation.text + self._lookout.remark()))
            self._open(silent=stop.silent)
        elif self._owed is not None:
            self._open()
        elif self._lost:
            self._lost = False
            self._said("the port is back")
        if self._asked_to_resume:
            self._asked_to_resume = False
            self._resume()

    def _alive(self) -> SharedPort:
        if self._port is None:
            raise ConnectionError(f"{self._name}: the port is gone")
        return self._port

    def _look_for_client(self, port: SharedPort) -> None:
        """Record whether a client is there, drop what the last one left unfinished, and resume for a new one."""
        now = self._clock.now()
        if now >= self._client_due:
            before, self._client, self._client_due = self._client, self._has_client(), now + CLIENT_S
            if self._client is False and before:
                port.drop_unfinished()
            if self._client and before is False and self.state is PortState.REFUSING and self._resumes_alone:
                self.resume()
        if self._client is not False:
            self._present = now

    def _stop(self) -> Stop | None:
        """Poll the hand if due, and return the reason for a stop, or None."""
        if self.state is not PortState.PASSING or self._homing():
            return None
        closed, restarts = self.closed, self._hand.restarts
        stop = self._lookout.look(closed=closed, restore=lambda: None)
        if not self._moved or self._homing():
            return None
        if stop is not None:
            return stop
        self._follow_heat()
        if (further := self._lookout.gate.released()) is not None:
            self._command(further)
        violation = self._of_the_client() if closed else None
        if violation is None and closed and self._hand.restarts > restarts:
            violation = Violation(
                SafetyReason.RESTARTED,
                "the board restarted while the hand was closed, and lost the client's speed and torque limits; check "
                "its supply",
            )
        return None if violation is None else Stop(violation, silent=False)

    def _follow_heat(self) -> None:
        """Follow the motors' heat, and say when a grip can be held for `WARNED_S` only."""
        lookout = self._lookout
        if lookout.read_at == self._heat_at:
            return
        self._heat_at = lookout.read_at
        self._heat.drawn(lookout.read_at, lookout.currents_a)
        if lookout.celsius is None or lookout.celsius is self._celsius:
            return
        self._celsius = lookout.celsius
        self._heat.felt(lookout.celsius)
        grip = self._heat.grip()
        left_s = math.inf if grip is None else grip.limit_s
        if left_s < next((one for one in WARNED_S if one < self._warned_s), 0.0):
            self._said(str(grip))
            self._warned_s = min(one for one in WARNED_S if left_s < one)
        elif left_s > 2 * WARNED_S[0]:
            self._warned_s = math.inf

    def _of_the_client(self) -> Violation | None:
        now, limit_s = self._clock.now(), self._kind.thresholds.unwatched_s
        if now - self._present > GONE_S:
            return Violation(
                SafetyReason.CLIENT_ENDED, "The client closed the port, or was killed, with the hand closed"
            )
        if now - self._heard > limit_s:
            return Violation(
                SafetyReason.UNWATCHED,
                f"the client has sent nothing for {now - self._heard:.0f} s to a closed hand (limit {limit_s:g} s)",
            )
        return None

    def _homing(self) -> bool:
        """Return whether the board homes for the client, and is silent; restart the polls at its end."""
        if math.isinf(self._homes_by):
            return False
        self._heard = self._present = self._clock.now()  # the first readings afterwards are from before the homing
        if self._alive().awaits(Opcode.HOMING) and self._clock.now() < self._homes_by:
            return True
        self._homes_by = -math.inf
        self._lookout.pause()
        return False

    def _owe(self, violation: Violation) -> None:
        self._owed, self.state = violation, PortState.OPENING

    def _open(self, *, silent: bool = False) -> None:
        """Open the hand slowly; a hand that may not be open is tried again in the next turn."""
        violation, hand = self._owed, self._hand
        if violation is None:
            return
        self._alive().drop_unfinished()
        try:
            doubt = open_and_relax(
                hand,
                self._alive().guards_end,
                self._kind.thresholds,
                settable=self._kind.usual is not None,
                last_codes=OPEN if self._goal is None else self._goal,
                silent=silent,
                homes_s=max(self._homes_by - self._clock.now(), 0.0),
            )
        except ConnectionError as error:
            self._tell(PortStop(violation, str(error)))
            raise
        self._homes_by = -math.inf
        if doubt is None:
            self._owed, self.state, self._lost = None, PortState.REFUSING, False
            self._moved = False
        self._tell(PortStop(violation, doubt))

    def _tell(self, stop: PortStop) -> None:
        """Report a stop, and later once more that the hand has opened after all."""
        first, self._told = self._told is not stop.violation, stop.violation
        if first:
            _LOG.warning("%s: %s", self._name, stop.text)
            self._stopped(stop)
        elif stop.doubt is None:
            self._said("the hand is open now. Commands are refused until `resume`")

    def _resume(self) -> None:
        """Accept commands again if the hand is cool and free, with the limits of its firmware."""
        if self.state is not PortState.REFUSING:
            return
        watch, limits = self._lookout.watch, self._kind.thresholds
        try:
            violation = watch.temperatures(self._hand.read_temperatures())
            drawn = np.abs(self._hand.read_currents())
            if violation is not None or drawn.max() > limits.current_a:
                most = Channel(int(np.argmax(drawn)))
                self._said(f"not resumed: {violation.text if violation else f'{most.label} draws {drawn.max():.1f} A'}")
                return
            if (usual := self._kind.usual) is not None:
                for channel in Channel:
                    self._hand.set_speed(channel, usual.speed)
                    self._hand.set_torque(channel, usual.torque)
        except AeroError as error:
            self._said(f"not resumed: {error}")
            return
        self._lookout.pause()
        self._goal, self._moved, self._in_torque_mode = None, False, False
        self._heard = self._present = self._clock.now()
        self.state = PortState.PASSING
        self._said("resumed: commands pass")

    def _end(self) -> bool:
        """Open a closed hand at the end of the guard, and return whether it is open."""
        try:
            if self.state is PortState.PASSING and self.closed:
                self._owe(Violation(SafetyReason.ENDED, "The guard ended"))
            if self._owed is not None:
                self._open()
        except ConnectionError as error:
            _LOG.error("%s: %s", self._name, error)
        finally:
            if self._port is not None:
                self._port.close()
        return self._owed is None

    def _screen(self, frame: bytes) -> bytes | None:
        """Return the frame to send for a client's frame, None for a refused one."""
        self._heard = self._present = self._clock.now()  # who sends is there, whatever the latest look said
        if self.state is PortState.OPENING:
            return None
        opcode = frame[0]
        if opcode in READINGS:
            return frame
        if self.state is PortState.REFUSING:
            self.refused += 1
            return None
        if opcode == Opcode.CTRL_POS:
            return self._positions(frame)
        if opcode == Opcode.CTRL_TOR:
            if self._kind.thresholds.forbidden:  # only a position can stop at an edge
                self.refused += 1
                return None
            self._begin()
            self._in_torque_mode, self._goal = True, None
            self._lookout.watch.encoders.forget()
        elif opcode in REDEFINES:
            self._begin()
            self._goal = None
            self._lookout.pause()
            if opcode == Opcode.HOMING:
                self._homes_by = self._clock.now() + HOMING_TIMEOUT_S
        return frame

    def _positions(self, frame: bytes) -> bytes:
        """Record a position command, and return it, or the one at the edge of a forbidden region."""
        codes = unsigned_values(parse_reply(frame)).astype(np.int64)
        sent = self._lookout.gate.passed(codes) if self._lookout.gate.bars else codes
        self._begin()
        self._expect(sent)
        return frame if sent is codes or np.array_equal(sent, codes) else make_positions(sent)

    def _command(self, codes: NDArray[np.int64]) -> None:
        """Send the rest of a client's command that a forbidden region had stopped."""
        self._alive().send(make_positions(codes), ours=True)
        self._expect(codes)

    def _expect(self, codes: NDArray[np.int64]) -> None:
        self._goal, self._in_torque_mode = codes, False
        self._lookout.watch.encoders.commanded(self._clock.now(), codes / MAX_CODE)

    def _begin(self) -> None:
        """Count from the first motion of a client; what the hand did before is no reason to stop it."""
        if not self._moved:
            self._moved = True
            self._lookout.watch.pause()
