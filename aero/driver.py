"""Driver of one Aero Hand Open, real or emulated, as seven channels in command order."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero import protocol
from aero.channels import Channel
from aero.clock import Clock, WallClock, positive_s
from aero.errors import DesyncError, EchoError, LinkTimeoutError, NoTelemetryError, RefusedError
from aero.link import HostLink
from aero.link_state import Content
from aero.overdue import LATE_S
from aero.protocol import Centred, Opcode, Reply, Trimmed
from aero.serial_transport import SerialTransport
from aero.transport import Transport

CURRENT_A_PER_UNIT = 6.5e-3
"""Nominal scale of the current register, A a unit. Doubtful: readings saturate at the torque limit (700 units would be
4.6 A; the datasheet states a 1.3 A peak), so a unit may be a fraction of the stall current."""
SPEED_RAD_PER_S_PER_UNIT = 0.732 * 2.0 * math.pi / 60.0
"""Scale of the speed register: 0.732 rpm a unit."""

TELEMETRY_AGE_S, TELEMETRY_AGE_PRE_S = 0.012, 0.032
"""Largest age of a value when the board sends it, s: telemetry period plus bus read, then with firmware `pre`. A cycle
that collides with a command is skipped, which adds a period."""

_TRIM_TIMEOUT_S = 2.0
_SET_ID_TIMEOUT_S = 5.0
HOMING_TIMEOUT_S = 200.0
_TELEMETRY_PERIOD_S = 0.02
_FIRST_TELEMETRY_TRIES = 3
_ECHOED = (1, 2, 3, 4, 5, 6, 7)
"""Test words; they cannot be seven temperatures."""


class LinkedHand(ABC):
    """Common part of a guarded and an unguarded hand: link state without an exchange. A `with` statement closes it."""

    def __init__(self, link: HostLink, clock: Clock) -> None:
        self._link = link
        self._clock = clock

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None:
        """Release the port; a second call does nothing."""

    @property
    def name(self) -> str:
        """Display name of the link, for messages."""
        return self._link.name

    @property
    def restarts(self) -> int:
        """Number of board starts detected; a start resets speed and torque limits to their defaults."""
        return self._link.restarts

    @property
    def boot_text(self) -> str:
        """Boot text received by this driver; non-empty means that the board has restarted."""
        return self._link.boot_text

    @property
    def reading_age_s(self) -> float:
        """Time since the request of the latest reading, s, of any thread.

        The board's telemetry cache adds up to 12 ms, 32 ms with firmware `pre`.
        """
        return self._clock.now() - self._link.read_from

    @property
    def settings_sent(self) -> Mapping[tuple[Opcode, Channel], int]:
        """Speed and torque limits set by this driver since the board started, by opcode and channel.

        Limits set by another program are unknown, because no board reports its limits.
        """
        return dict(self._link.settings)


class AeroHand(LinkedHand):
    """Unguarded Aero Hand Open on a transport.

    The protocol does not acknowledge commands. Readings are from the board's telemetry cache and normally less than
    12 ms old (32 ms with firmware `pre`), but stale while the board homes. Threads may share a hand: each call is one
    exchange under a lock.
    """

    def __init__(self, transport: Transport, clock: Clock, longest_s: float = LATE_S) -> None:
        """Wrap an open transport; `clock` is used for time and waits; `longest_s` (s) is the time-out of a reading."""
        super().__init__(HostLink(transport, clock, longest_s), clock)
        self._telemetry_seen_at_restart: int | None = None

    @classmethod
    def open_unguarded(cls, port_or_url: str) -> Self:
        """Open an unguarded hand on a device path or pyserial URL; to move a hand, prefer `aero.open_hand`.

        After the program ends, the hand keeps its last command, possibly closed at full torque.

        Raises:
            ConnectionError: the port cannot be opened; the message has the reason and the ports of this computer.
        """
        return cls(SerialTransport.open(port_or_url), WallClock())

    def close(self) -> None:
        """Release the port; the hand keeps its last command. A second call does nothing."""
        self._link.close()

    @property
    def disturbances(self) -> int:
        """Number of failed exchanges and of board starts."""
        return self._link.disturbances

    @property
    def silent_from(self) -> float | None:
        """Send time of the first unanswered request, clock s; None while the board answers."""
        return self._link.silent_from

    def command_codes(self, codes: ArrayLike) -> None:
        """Send every channel to a position.

        Args:
            codes: (7,) integers in 0..65535, command order; 0 is open, 65535 closed. See `ActuationMap`.

        Raises:
            ValueError: wrong shape, not integers, out of range; nothing is sent.
            ConnectionError: the link is lost.
            DesyncError: the board may be out of step; nothing is sent until `resynchronise` succeeds.
        """
        frame = protocol.make_positions(codes)
        self._link.send(frame)

    def command_codes_blindly(self, codes: ArrayLike) -> None:
        """Send every channel near a position, in bytes without opcodes, safe for a board that is out of step.

        This is the only command allowed after a failed `resynchronise`. A board in step executes it with each code
        lowered by up to 1279.

        Arguments and errors as `command_codes`, except that DesyncError is raised only if an earlier frame may have
        been sent incompletely.
        """
        frame = protocol.make_harmless_positions(codes)
        self._link.send(frame, Content.HARMLESS_FRAME)

    def command_torques(self, magnitudes: ArrayLike) -> None:
        """Pull every channel closed with a torque, without position control; the protocol cannot pull open.

        Firmware before 0.1.0 ignores the command.

        Args:
            magnitudes: (7,) integers in 0..1000, torque register units (about 0.5 mN m), command order.

        Raises:
            ValueError: wrong shape, not integers, out of range; nothing is sent.
            ConnectionError, DesyncError: as `command_codes`.
        """
        frame = protocol.make_torques(magnitudes)
        self._link.send(frame)

    def read_codes(self) -> NDArray[np.uint16]:
        """Read positions, (7,) uint16 in 0..65535, command order, on the scale of `command_codes`.

        Readings saturate at both ends of the window. One servo count is 20..58 codes, and the board rounds towards 0.

        Raises:
            LinkTimeoutError, DesyncError, ConnectionError: no reply, no valid frame, link lost.
            NoTelemetryError: the board has not reached all seven servos since it started.
        """
        return protocol.unsigned_values(self._read(Opcode.GET_POS))

    def read_currents(self) -> NDArray[np.float64]:
        """Read motor currents, (7,) float, A, command order, at the nominal `CURRENT_A_PER_UNIT`.

        Sign as in the register: positive pulls towards lower counts (observed on one physical hand). A positive current
        closes all channels of a right hand but the flexor, and only the flexor of a left hand. Errors as `read_codes`.
        """
        return protocol.signed_values(self._read(Opcode.GET_CURR)).astype(np.float64) * CURRENT_A_PER_UNIT

    def read_temperatures(self) -> NDArray[np.float64]:
        """Read servo temperatures, (7,) float, whole °C, command order; errors as `read_codes`."""
        return protocol.unsigned_values(self._read(Opcode.GET_TEMP)).astype(np.float64)

    def read_speeds(self) -> NDArray[np.float64]:
        """Read shaft speeds, (7,) float, rad/s, command order; errors as `read_codes`.

        Sign as in the register: positive towards higher counts by Feetech's convention, not yet verified on a hand.
        """
        return protocol.signed_values(self._read(Opcode.GET_VEL)).astype(np.float64) * SPEED_RAD_PER_S_PER_UNIT

    def set_speed(self, channel: Channel, register_units: int) -> None:
        """Set one channel's speed limit (0..32766 register units; 32766 disables it), effective with the next position.

        A restart of the board resets the limit.

        Raises:
            ValueError: out of range; nothing is sent.
            RefusedError: the board stored another value.
        """
        self._set(Opcode.SET_SPE, channel, register_units, protocol.make_set_speed(channel, register_units))

    def set_torque(self, channel: Channel, register_units: int) -> None:
        """Set one channel's torque limit (0..1023 register units); otherwise as `set_speed`."""
        self._set(Opcode.SET_TOR, channel, register_units, protocol.make_set_torque(channel, register_units))

    def knows(self, opcode: Opcode) -> bool:
        """Return whether the board knows SET_TOR (all but firmware `pre`) or CALIBRATE_MID (only `main`).

        The request names an invalid channel: a board that knows the opcode refuses, another one does not reply. No
        setting changes. Errors as `read_codes`.
        """
        try:
            self._link.ask(protocol.make_refused(opcode))
        except LinkTimeoutError:
            self._query(Opcode.GET_TEMP)  # raises if the board answers nothing at all
            return False
        return True

    def trim(self, channel: Channel, degrees: int) -> Trimmed:
        """Shift one channel's extended end by whole degrees (-360..360) of its shaft; sent once, without retry.

        The board stores trims over restarts. They add up until the next homing, or power-on with firmware 0.1.3 and
        later. A trim by 0 changes nothing; with firmware `main` its reply has the servo's position.
        """
        return protocol.trimmed(self._acknowledged(protocol.make_trim(channel, degrees), channel, _TRIM_TIMEOUT_S))

    def calibrate_mid(self, channel: Channel) -> Centred:
        """Redefine a channel's current position as 2048 counts, mid-turn of its servo; only with firmware `main`.

        The command window does not move with the zero, so every code means another angle afterwards: **the finger may
        jump with the next command**. The servo stores its zero over power-off, until the next homing. Sent once.

        Raises:
            LinkTimeoutError: the firmware is older than `main`, or the board does not answer.
            RefusedError: the board is in torque mode, or the servo did not answer; its zero may have moved.
        """
        result = protocol.centred(self._acknowledged(protocol.make_calibrate_mid(channel), channel, _TRIM_TIMEOUT_S))
        if result is None:
            raise RefusedError(
                f"{self.name}: {channel.label} was not calibrated. The board is in torque mode (command_codes() ends "
                "it), or the servo did not answer. Its zero may have moved; home the hand before anything else."
            )
        return result

    def home(self, timeout_s: float = HOMING_TIMEOUT_S) -> None:
        """Home all channels and wait for the acknowledgement: about 4 s, a minute up to firmware 0.1.2.

        The board acknowledges even if a servo is missing or never met its stop, so check the positions afterwards.

        Args:
            timeout_s: time-out, s; the longest homing (0.1.2, every search timing out) takes 194 s.

        Raises:
            ValueError: the time-out is not positive and finite; nothing is sent.
            LinkTimeoutError: no acknowledgement within `timeout_s`.
        """
        positive_s("timeout_s", timeout_s)
        self._link.ask(protocol.make_query(Opcode.HOMING), timeout_s)
        self._wait(2 * _TELEMETRY_PERIOD_S)

    def set_id(self, new_id: int, current_limit: int) -> int:
        """Set the ID (0..253) and the current limit (0..1023 register units) of the only servo on the bus.

        Returns:
            Previous ID of the servo.

        Raises:
            ValueError: out of range; nothing is sent.
            RefusedError: no servo, more than one, or the servo did not store the setting.
        """
        frame = protocol.make_set_id(new_id, current_limit)
        reply = self._link.ask(frame, _SET_ID_TIMEOUT_S).reply
        old_id, stored_id, stored_limit = reply.words[:3]
        if old_id > protocol.MAX_SERVO_ID:
            found = "no servo" if old_id == 0xFF else "more than one servo"
            raise RefusedError(f"{self.name}: the board found {found} on its bus. Connect exactly one and try again.")
        if (stored_id, stored_limit) != (new_id, current_limit):
            raise RefusedError(
                f"{self.name}: asked for ID {new_id} and limit {current_limit}, the servo says {stored_id} and "
                f"{stored_limit}. It may have been busy storing; try again."
            )
        return old_id

    def resynchronise(self) -> int:
        """Resynchronise a board that waits for the rest of an incomplete frame; takes three seconds if none answers.

        The incomplete frame is padded with zeros and executed, because the board cannot drop it: a position command
        then opens the channels missing from the frame.

        Until a search succeeds, all other commands are refused: a failed search may itself leave the board out of
        step, so that it would read a position as an opcode.

        Returns:
            Number of stray bytes in the board's buffer, 0..15.

        Raises:
            LinkTimeoutError: the board does not answer; call this method again.
        """
        return self._link.resynchronise()

    def _read(self, opcode: Opcode) -> Reply:
        reply = self._query(opcode)
        for _ in range(_FIRST_TELEMETRY_TRIES):
            known_alive = self._telemetry_seen_at_restart == self._link.restarts
            if known_alive or any(reply.words) or any(self._query(Opcode.GET_TEMP).words):
                self._telemetry_seen_at_restart = self._link.restarts
                return reply
            self._wait(_TELEMETRY_PERIOD_S)
            reply = self._query(opcode)
        # The board ignores the words of a query; a loop-back or an echoing adapter returns them.
        probe = protocol.make_reply(Opcode.GET_TEMP, _ECHOED)
        if {*self._link.ask(probe).reply.words} == {*_ECHOED}:
            raise EchoError(
                f"{self.name}: this line only echoes what is sent, and no hand answers; is this a loop-back, or the "
                "port of an adapter that echoes?"
            )
        raise NoTelemetryError(
            f"{self.name}: the board answers, but all readings are zero, temperatures included: since its start it "
            "has never read all seven servos. One missing servo or loose bus connector is enough. Check the servos' "
            "supply, the bus cables and the boot text."
        )

    def _query(self, opcode: Opcode) -> Reply:
        answer = self._link.ask(protocol.make_query(opcode))
        self._link.read_from = answer.asked
        return answer.reply

    def _set(self, opcode: Opcode, channel: Channel, value: int, request: bytes) -> None:
        stored = self._acknowledged(request, channel).words[1]
        if stored != value:
            raise RefusedError(f"{self.name}: asked {channel.label} for {value}, the board stored {stored}.")
        self._link.settings[opcode, channel] = value

    def _acknowledged(self, request: bytes, channel: Channel, once_s: float | None = None) -> Reply:
        reply = self._link.ask(request, once_s).reply
        number = protocol.wire_index(channel)
        if reply.words[0] == protocol.REFUSED_CHANNEL:
            raise RefusedError(f"{self.name}: the board knows no channel {number} ({channel.label}).")
        if reply.words[0] != number:
            raise DesyncError(
                f"{self.name}: asked about channel {number} ({channel.label}), the board answered about "
                f"{reply.words[0]}. Is another program using the port?"
            )
        return reply

    def _wait(self, seconds: float) -> None:
        self._clock.sleep_until(self._clock.now() + seconds)
