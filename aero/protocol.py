"""The host protocol as the driver speaks it: bytes in, values out, and no port, clock or thread in here.

Every frame has sixteen bytes in both directions: opcode, filler, seven little-endian words. There is no checksum, no
start mark and no sequence number. The board takes bytes sixteen at a time and never looks for a frame's start, so a
single stray byte shifts everything after it; the host can do better because a reply starts with a known opcode and a
zero filler, and because nothing but boot text is ever sent unasked.

The words of a frame are in wire order, which is the servos' ID order. This is the only module of the driver that
knows it: what goes in and what comes out is in command order.

Source: TetherIA aero-open-firmware d7bd82e and aero-hand-open 6a3022d (firmware 0.1.0 and 0.2.0, same frames), dd91e5a
(`main`: CALIBRATE_MID and the longer acknowledgement of TRIM).
"""

from __future__ import annotations

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
"""Bytes of a frame by which a reply is known."""
_CHANNELS = len(Channel)
# Of seven values, which stay plain numbers: for so few, arrays cost more than they spare.
_to_wire = itemgetter(*map(int, WIRE_ORDER))
_from_wire = itemgetter(*(WIRE_ORDER.index(channel) for channel in Channel))

MAX_CODE = 0xFFFF
"""Largest position code; 0 is one end of the command window and this the other, closed one."""
MAX_TORQUE_COMMAND = 1000
"""Largest magnitude in torque mode; the board clamps there."""
MAX_SPEED_SETTING = 32766
"""Largest speed register value that the board stores."""
MAX_TORQUE_SETTING = 1023
"""Largest torque limit that the board stores."""
MAX_SERVO_ID = 253
"""Largest ID a servo can be given."""
REFUSED_CHANNEL = 0xFFFF
"""First word of a refused setting's acknowledgement."""

BOOT_TEXT_MARKS = (b"ESP-ROM:", b"[BOOT]", b"[Init]", b"  ID ", b"Servo ")
"""Fragments of which at least one is in any stretch of text that a starting board prints: the chip's ROM, which a host
sees that is connected while the board restarts, and firmwares pre to 0.2.0."""


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
"""Queries that change nothing, whenever they are carried out."""

_HARMLESS_BELOW = [max({*range(byte + 1)} - {*Opcode}) for byte in range(256)]
"""The next byte from each one down that is no opcode."""

SINCE = {
    **dict.fromkeys((Opcode.CTRL_TOR, Opcode.SET_SPE, Opcode.SET_TOR), "0.1.0"),
    Opcode.CALIBRATE_MID: "`main` of July 2026",
}
"""The firmware that first knew an opcode; earlier ones drop the frame and say nothing."""

_NO_CHANNEL = {Opcode.SET_TOR: REFUSED_CHANNEL, Opcode.CALIBRATE_MID: len(Channel)}
"""A channel that no board has, in a request for it to refuse."""

PADDING = b"\0"
"""A byte that does no harm wherever the board reads it: opcode 0 is unknown and swallows its frame in silence."""


class Reply(NamedTuple):
    """One frame from the board."""

    opcode: int
    """First byte; an `Opcode` in every reply the board sends."""
    words: tuple[int, ...]
    """Seven unsigned words in the order of the wire."""


@lru_cache
def make_query(opcode: Opcode) -> bytes:
    """Return a request whose payload the board ignores: a GET or HOMING."""
    return _FRAME.pack(opcode, FILLER, *(0,) * _CHANNELS)


def position_codes(codes: ArrayLike) -> NDArray[np.int64]:
    """Return a copy of position codes (7,) that nobody else can change; raises as `make_positions`."""
    return _constant(_checked_words(codes, MAX_CODE, "position codes"))


def torque_magnitudes(magnitudes: ArrayLike) -> NDArray[np.int64]:
    """Return a copy of torque magnitudes (7,) that nobody else can change; raises as `make_torques`."""
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
    """Return a position command that does no harm to a board which is out of step, wherever it begins to read.

    No byte after the first is an opcode. For this each code is lowered by up to 1279 of 65535. As `make_positions`.
    """
    return make_positions([_HARMLESS_BELOW[code >> 8] << 8 for code in position_codes(codes).tolist()])


def make_torques(magnitudes: ArrayLike) -> bytes:
    """Return a torque command; every channel is pulled closed, the protocol has no other direction.

    The magnitudes (7,) are integers in 0..1000, units of the servo's torque register; otherwise as `make_positions`.
    """
    return _make_channel_words(Opcode.CTRL_TOR, magnitudes, MAX_TORQUE_COMMAND, "torque magnitudes")


def make_set_speed(channel: Channel, register_units: int) -> bytes:
    """Return a request to limit one channel's speed to 0..32766 register units from its next position command on."""
    return _make_setting(Opcode.SET_SPE, channel, _checked_int(register_units, 0, MAX_SPEED_SETTING, "speed setting"))


def make_set_torque(channel: Channel, register_units: int) -> bytes:
    """Return a request to limit one channel's torque to 0..1023 register units from its next position command on."""
    return _make_setting(Opcode.SET_TOR, channel, _checked_int(register_units, 0, MAX_TORQUE_SETTING, "torque setting"))


def make_trim(channel: Channel, degrees: int) -> bytes:
    """Return a request to shift one channel's extended end by `degrees` (-360..360) of its shaft."""
    return _make_setting(Opcode.TRIM, channel, _checked_int(degrees, -360, 360, "trim in degrees") & 0xFFFF)


def make_calibrate_mid(channel: Channel) -> bytes:
    """Return a request to make a channel's present position 2048 counts, the middle of its servo's turn."""
    return _FRAME.pack(Opcode.CALIBRATE_MID, FILLER, wire_index(channel), 0, 0, 0, 0, 0, 0)


def make_refused(opcode: Opcode) -> bytes:
    """Return a request about a channel that no board has: a board that knows SET_TOR or CALIBRATE_MID refuses it.

    One that does not know it says nothing. Nothing changes.

    Raises:
        ValueError: another opcode.
    """
    if opcode not in _NO_CHANNEL:
        raise ValueError(f"no board refuses {opcode!r}; it does {', '.join(one.name for one in _NO_CHANNEL)}")
    return _FRAME.pack(opcode, FILLER, _NO_CHANNEL[opcode], 0, 0, 0, 0, 0, 0)


def make_set_id(new_id: int, current_limit: int) -> bytes:
    """Return a request to give the only servo on the bus `new_id` (0..253) and a current limit (0..1023 units)."""
    words = [
        _checked_int(new_id, 0, MAX_SERVO_ID, "servo ID"),
        _checked_int(current_limit, 0, MAX_TORQUE_SETTING, "current limit"),
    ]
    return _FRAME.pack(Opcode.SET_ID, FILLER, *words, 0, 0, 0, 0, 0)


def parse_reply(frame: bytes) -> Reply:
    """Take a frame of exactly sixteen bytes apart.

    Raises:
        ValueError: another length.
    """
    if len(frame) != FRAME_SIZE:
        raise ValueError(f"a frame has {FRAME_SIZE} bytes, got {len(frame)}")
    opcode, _, *words = _FRAME.unpack(frame)
    return Reply(opcode, tuple(words))


def make_reply(opcode: Opcode, values: ArrayLike) -> bytes:
    """Return the reply that carries values (7,), command order, rounded to its words; negative ones as int16.

    Raises:
        ValueError: wrong shape, or no word holds one of them.
    """
    array = np.asarray(values, np.float64)
    if array.shape != (_CHANNELS,) or not ((array > -0x8000 - 0.5) & (array < MAX_CODE + 0.5)).all():
        raise ValueError(f"reply: expected {_CHANNELS} values in -32768..{MAX_CODE}, got {array.tolist()}")
    words = np.rint(array).astype(np.int64) & 0xFFFF
    return _FRAME.pack(opcode, FILLER, *_to_wire(words.tolist()))


UNREAD = 0xFFFF
"""Position word when the board could not read the servo, or a step before it failed."""


class Trimmed(NamedTuple):
    """The acknowledgement of a trim."""

    extend_counts: int
    """The extended end of the channel's window, servo counts 0..4095."""
    position_counts: int | None
    """Where the servo stands, counts 0..4095. None with firmware before `main`, and where the servo reads below 0; a
    servo that did not answer comes out as 1."""


class Centred(NamedTuple):
    """The acknowledgement of a calibration."""

    position_counts: int
    """Where the servo stands now, counts 0..4095; about 2048."""
    code: int
    """The same place as a position code, 0..65535."""
    near_middle: bool
    """Whether the board takes it for the middle, 2000 to 2096 counts."""


def trimmed(reply: Reply) -> Trimmed:
    """Take the acknowledgement of a trim apart; its fifth word is the version of the longer form, 0 without one."""
    _, extend, position, _, version = reply.words[:5]
    return Trimmed(extend, position if version and position != UNREAD else None)


def centred(reply: Reply) -> Centred | None:
    """Take the acknowledgement of a calibration apart; None when the board refused it or a step failed."""
    _, position, code, far = reply.words[:4]
    return None if position == UNREAD else Centred(position, code, far == 0)


def unsigned_values(reply: Reply) -> NDArray[np.uint16]:
    """Return the words of a reply as (7,) uint16 in command order: position codes or °C."""
    return np.array(_from_wire(reply.words), np.uint16)


def signed_values(reply: Reply) -> NDArray[np.int16]:
    """Return the words of a reply as (7,) int16 in command order: speed or current register units."""
    return unsigned_values(reply).view(np.int16)


def wire_index(channel: Channel) -> int:
    """Return the number by which the board knows a channel, which is also its servo's ID."""
    return WIRE_ORDER.index(channel)


def holds_boot_text(data: bytes) -> bool:
    """Whether a starting board printed some of `data`."""
    return any(mark in data for mark in BOOT_TEXT_MARKS)


class ReplyScanner:
    """Finds the next reply in a stream that may also hold boot text and fragments.

    It is the first place that looks like the start of one of the replies that can come. Taking the stream apart in
    whole frames keeps a value that looks like a start, as 35 °C does, from being taken for one. Without a checksum a
    fragment can still pass for a reply; then bytes are left over, which are a fault.
    """

    def __init__(self, *opcodes: Opcode) -> None:
        """Look for replies with any of `opcodes`."""
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
        """Everything received that is not part of the reply."""
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
