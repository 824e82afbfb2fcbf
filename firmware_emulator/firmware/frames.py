"""Host frames: 16 bytes both ways, opcode, filler, seven little-endian words in wire order; no checksum, no sync.

Source: aero-open-firmware d7bd82e, `firmware_v0.1.0.ino`.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from struct import Struct

FRAME_SIZE = 16
CHANNELS = 7
FRAME = Struct("<BB7H")
"""Opcode, filler and words of a frame."""


class Opcode(IntEnum):
    """What the firmware answers to; everything else is consumed in silence."""

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


def words_of(frame: bytes) -> tuple[int, ...]:
    """Return the seven payload words of a frame, unsigned."""
    return FRAME.unpack(frame)[2:]


def reply(opcode: int, words: Sequence[int]) -> bytes:
    """Return a frame from up to seven words (unsigned, or signed 16-bit); missing ones are zero."""
    payload = [word & 0xFFFF for word in words]
    return FRAME.pack(opcode, 0, *payload, *(0,) * (CHANNELS - len(payload)))
