"""Codec of the host protocol: bytes in, values out; no port, clock or thread.

Every frame has sixteen bytes in both directions: opcode, filler, seven little-endian words. There is no checksum, start
mark or sequence number. The board reads bytes sixteen at a time and never searches for a frame start, so one stray byte
shifts all later frames. The host can resynchronise, because a reply starts with a known opcode and a zero filler, and
the only unsolicited bytes are boot text.

The words of a frame are in wire order, which is the servos' ID order. Only this module of the driver uses wire order;
all arguments and results are in command order.

Source: TetherIA aero-open-firmware d7bd82e and aero-hand-open 6a3022d (firmware 0.1.0 and 0.2.0, same frames), dd91e5a
(`main`: CALIBRATE_MID and the longer acknowledgement of TRIM).
"""

import struct
from enum import IntEnum
from functools import lru_cache
from operator import itemgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import WIRE_ORDER, Channel

FRAME_SIZE = 16
_FRAME = struct.Struct("<BB7H")
FILLER = 0
"""Second byte of a frame."""
_HEAD = range(2)
"""Indices of the bytes that identify a reply."""
_CHANNELS = len(Channel)
# Plain numbers, because for seven values an array costs more time than it saves.
_to_wire = itemgetter(*map(int, WIRE_ORDER))
_from_wire = itemgetter(*(WIRE_ORDER.index(channel) for channel in Channel))

MAX_CODE = 0xFFFF
"""Position code of the closed end of the command window; 0 is the open end."""
MAX_TORQUE_COMMAND = 1000
"""Largest magnitude in torque mode; the board clips larger ones."""
MAX_SPEED_SETTING = 32766
"""Largest speed register value that the board stores."""
MAX_TORQUE_SETTING = 1023
"""Largest torque limit that the board stores."""
MAX_SERVO_ID = 253
REFUSED_CHANNEL = 0xFFFF
"""First word of a refused setting's acknowledgement."""

BOOT_TEXT_MARKS = (b"ESP-ROM:", b"[BOOT]", b"[Init]", b"  ID ", b"Servo ")
"""Fragments that identify boot text; any stretch of it has at least one. Sources: the chip's ROM, seen by a host that
is connected during a restart, and firmware `pre` to 0.2.0."""


class Opcode(IntEnum):
    """First byte of a frame; a reply carries the opcode of its request."""

    HOMING = 0x01
    SET_ID = 0x02
    TRIM = 0x03
    CALIBRATE_MID = 0x04
    CTRL_POS = 0x11
    CTRL_TOR = 0x12
    GET_POS = 0x22
    GET_VEL = 0x23
    GET_CURR = 0x24
    GET_TEMP = 0x25
    SET_SPE = 0x31
    SET_TOR = 0x32


READINGS = (Opcode.GET_TEMP, Opcode.GET_VEL, Opcode.GET_CURR, Opcode.GET_POS)
"""Queries without side effects, safe at any time."""

_HARMLESS_BELOW = [max({*range(byte + 1)} - {*Opcode}) for byte in range(256)]
"""Largest byte up to each index that is not an opcode."""

SINCE = {
    **dict.fromkeys((Opcode.CTRL_TOR, Opcode.SET_SPE, Opcode.SET_TOR), "0.1.0"),
    Opcode.CALIBRATE_MID: "`main` of July 2026",
}
"""First firmware that knows an opcode; earlier ones drop the frame without a reply."""

_NO_CHANNEL = {Opcode.SET_TOR: REFUSED_CHANNEL, Opcode.CALIBRATE_MID: len(Channel)}
"""Invalid channel by opcode, for a request that the board must refuse."""

PADDING = b"\0"
"""Byte that is harmless at every alignment: the board ignores a frame with opcode 0."""


class Reply(NamedTuple):
    """One frame from the board."""

    opcode: int
    """First byte; an `Opcode` in every genuine reply."""
    words: tuple[int, ...]
    """Seven unsigned words in wire order."""


@lru_cache
def make_query(opcode: Opcode) -> bytes:
    """Return a request whose payload the board ignores: a GET or HOMING."""
    return _FRAME.pack(opcode, FILLER, *(0,) * _CHANNELS)


def position_codes(codes: ArrayLike) -> NDArray[np.int64]:
    """Return a read-only copy of position codes (7,); raises as `make_positions`."""
    return _constant(_checked_words(codes, MAX_CODE, "position codes"))


def torque_magnitudes(magnitudes: ArrayLike) -> NDArray[np.int64]:
    """Return a read-only copy of torque magnitudes (7,); raises as `make_torques`."""
    return _constant(_checked_words(magnitudes, MAX_TORQUE_COMMAND, "torque magnitudes"))


def make_positions(codes: ArrayLike) -> bytes:
    """Return a position command.

    Args:
        codes: (7,) integers in 0..65535, command order.

    Raises:
        ValueError: wrong shape, not integers, or out of range.
    """
    return _make_channel_words(Opcode.CTRL_POS, codes, MAX_CODE, "position codes")


def make_harmless_positions(codes: ArrayLike) -> bytes:
    """Return a position command that is harmless at every alignment, for a board that may be out of step.

    No byte after the first is an opcode; each code is lowered by up to 1279 of 65535. Otherwise as `make_positions`.
    """
    return make_positions([_HARMLESS_BELOW[code >> 8] << 8 for code in position_codes(codes).tolist()])


def make_torques(magnitudes: ArrayLike) -> bytes:
    """Return a torque command, which pulls every channel closed; the protocol has no opening torque.

    The magnitudes (7,) are integers in 0..1000, units of the servo's torque register; otherwise as `make_positions`.
    """
    return _make_channel_words(Opcode.CTRL_TOR, magnitudes, MAX_TORQUE_COMMAND, "torque magnitudes")


def make_set_speed(channel: Channel, register_units: int) -> bytes:
    """Return a request for a speed limit of one channel, 0..32766 register units, effective with its next position."""
    return _make_setting(Opcode.SET_SPE, channel, _checked_int(register_units, 0, MAX_SPEED_SETTING, "speed setting"))


def make_set_torque(channel: Channel, register_units: int) -> bytes:
    """Return a request for a torque limit of one channel, 0..1023 register units, effective with its next position."""
    return _make_setting(Opcode.SET_TOR, channel, _checked_int(register_units, 0, MAX_TORQUE_SETTING, "torque setting"))


def make_trim(channel: Channel, degrees: int) -> bytes:
    """Return a request to shift one channel's extended end by `degrees` (-360..360) of its shaft."""
    return _make_setting(Opcode.TRIM, channel, _checked_int(degrees, -360, 360, "trim in degrees") & 0xFFFF)


def make_calibrate_mid(channel: Channel) -> bytes:
    """Return a request to redefine a channel's current position as 2048 counts, mid-turn of its servo."""
    return _FRAME.pack(Opcode.CALIBRATE_MID, FILLER, wire_index(channel), 0, 0, 0, 0, 0, 0)


def make_refused(opcode: Opcode) -> bytes:
    """Return a SET_TOR or CALIBRATE_MID request for an invalid channel.

    A board that knows the opcode refuses the request, another one does not reply. No setting changes.

    Raises:
        ValueError: another opcode.
    """
    if opcode not in _NO_CHANNEL:
        raise ValueError(f"expected {' or '.join(one.name for one in _NO_CHANNEL)}, got {opcode!r}")
    return _FRAME.pack(opcode, FILLER, _NO_CHANNEL[opcode], 0, 0, 0, 0, 0, 0)


def make_set_id(new_id: int, current_limit: int) -> bytes:
    """Return a request to set ID (0..253) and current limit (0..1023 units) of the only servo on the bus."""
    words = [
        _checked_int(new_id, 0, MAX_SERVO_ID, "servo ID"),
        _checked_int(current_limit, 0, MAX_TORQUE_SETTING, "current limit"),
    ]
    return _FRAME.pack(Opcode.SET_ID, FILLER, *words, 0, 0, 0, 0, 0)


def parse_reply(frame: bytes) -> Reply:
    """Parse a frame of exactly sixteen bytes.

    Raises:
        ValueError: another length.
    """
    if len(frame) != FRAME_SIZE:
        raise ValueError(f"a frame has {FRAME_SIZE} bytes, got {len(frame)}")
    opcode, _, *words = _FRAME.unpack(frame)
    return Reply(opcode, tuple(words))


def make_reply(opcode: Opcode, values: ArrayLike) -> bytes:
    """Return a reply with values (7,), command order, rounded to integers; negative ones as int16.

    Raises:
        ValueError: wrong shape, or a value outside -32768..65535.
    """
    array = np.asarray(values, np.float64)
    if array.shape != (_CHANNELS,) or not ((array > -0x8000 - 0.5) & (array < MAX_CODE + 0.5)).all():
        raise ValueError(f"reply: expected {_CHANNELS} values in -32768..{MAX_CODE}, got {array.tolist()}")
    words = np.rint(array).astype(np.int64) & 0xFFFF
    return _FRAME.pack(opcode, FILLER, *_to_wire(words.tolist()))


UNREAD = 0xFFFF
"""Position word if the board could not read the servo, or an earlier step failed."""


class Trimmed(NamedTuple):
    """Acknowledgement of a trim."""

    extend_counts: int
    """Extended end of the channel's window, servo counts 0..4095."""
    position_counts: int | None
    """Servo position, counts 0..4095. None with firmware before `main` or for a position below 0; 1 if the servo did
    not answer."""


class Centred(NamedTuple):
    """Acknowledgement of a calibration."""

    position_counts: int
    """Servo position after the calibration, counts 0..4095; about 2048."""
    code: int
    """Servo position after the calibration as a position code, 0..65535."""
    near_middle: bool
    """True if the board accepts the position as mid-turn, 2000 to 2096 counts."""


def trimmed(reply: Reply) -> Trimmed:
    """Parse the acknowledgement of a trim; word 5 is the version of the long form, 0 in the short form."""
    _, extend, position, _, version = reply.words[:5]
    return Trimmed(extend, position if version and position != UNREAD else None)


def centred(reply: Reply) -> Centred | None:
    """Parse the acknowledgement of a calibration; None if the board refused it or a step failed."""
    _, position, code, far = reply.words[:4]
    return None if position == UNREAD else Centred(position, code, far == 0)


def unsigned_values(reply: Reply) -> NDArray[np.uint16]:
    """Return the words of a reply as (7,) uint16 in command order: position codes or °C."""
    return np.array(_from_wire(reply.words), np.uint16)


def signed_values(reply: Reply) -> NDArray[np.int16]:
    """Return the words of a reply as (7,) int16 in command order: speed or current register units."""
    return unsigned_values(reply).view(np.int16)


def wire_index(channel: Channel) -> int:
    """Return a channel's index on the wire, which is also its servo's ID."""
    return WIRE_ORDER.index(channel)


def holds_boot_text(data: bytes) -> bool:
    """Return whether `data` contains boot text."""
    return any(mark in data for mark in BOOT_TEXT_MARKS)


class ReplyScanner:
    """Scanner for the next reply in a stream with boot text and fragments.

    A reply begins at the first bytes that match the start of an expected one. Consuming whole frames prevents false
    starts at a value such as 35 °C, which looks like an opcode. Without a checksum a fragment can still pass for a
    reply; the surplus bytes then reveal the fault.
    """

    def __init__(self, *opcodes: Opcode) -> None:
        """Expect replies with any of `opcodes`."""
        self._heads = [bytes((opcode, FILLER)) for opcode in opcodes]
        self._buffer = bytearray()
        self._start = 0
        self._found = False

    def feed(self, data: bytes) -> Reply | None:
        """Add received bytes and return the reply once it is complete."""
        self._buffer += data
        while self._start < len(self._buffer) and not self._may_start():
            self._start += 1
        if len(self._buffer) - self._start < FRAME_SIZE:
            return None
        self._found = True
        return parse_reply(bytes(self._buffer[self._start : self._start + FRAME_SIZE]))

    @property
    def missing(self) -> int:
        """Fewest further bytes that can complete the reply, 1..16."""
        return FRAME_SIZE - (len(self._buffer) - self._start)

    @property
    def stray(self) -> bytes:
        """Received bytes outside the reply."""
        if not self._found:
            return bytes(self._buffer)
        return bytes(self._buffer[: self._start] + self._buffer[self._start + FRAME_SIZE :])

    def _may_start(self) -> bool:
        seen = self._buffer[self._start : self._start + len(_HEAD)]
        return seen in self._heads or (len(seen) < len(_HEAD) and any(head.startswith(seen) for head in self._heads))


def _make_channel_words(opcode: Opcode, values: ArrayLike, highest: int, what: str) -> bytes:
    return _FRAME.pack(opcode, FILLER, *_to_wire(_checked_words(values, highest, what)))


def _constant(words: list[int]) -> NDArray[np.int64]:
    array = np.array(words, np.int64)
    array.flags.writeable = False
    return array


def _checked_words(values: ArrayLike, highest: int, what: str) -> list[int]:
    """Return seven integers in 0..`highest`, one a channel, read once."""
    array = np.asarray(values)
    if array.shape != (_CHANNELS,):
        raise ValueError(f"{what}: expected shape ({_CHANNELS},), one a channel in command order, got {array.shape}")
    if array.dtype.kind not in "iu":
        raise ValueError(f"{what}: expected integers in 0..{highest}, got {array.dtype} {array.tolist()}")
    words: list[int] = array.tolist()
    if min(words) < 0 or max(words) > highest:
        named = ", ".join(f"{Channel(i).label} {word}" for i, word in enumerate(words) if not 0 <= word <= highest)
        raise ValueError(f"{what}: expected 0..{highest}, got {named}")
    return words


def _make_setting(opcode: Opcode, channel: Channel, word: int) -> bytes:
    return _FRAME.pack(opcode, FILLER, wire_index(Channel(channel)), word, 0, 0, 0, 0, 0)


def _checked_int(value: int, lowest: int, highest: int, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not lowest <= value <= highest:
        raise ValueError(f"{what}: expected an integer in {lowest}..{highest}, got {value!r}")
    return int(value)
