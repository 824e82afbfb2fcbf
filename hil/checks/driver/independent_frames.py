"""Second implementation of the host frames, to test `aero.protocol`; shares no code with it.

Source: firmware of the hand, `main` of July 2026: opcode, filler, seven little-endian words, servo IDs in wire order.
"""

import struct
from enum import IntEnum

FRAME = struct.Struct("<BB7H")
SERVO_OF_CHANNEL = (3, 4, 5, 6, 0, 1, 2)
"""Servo ID of each channel, command order."""


class Opcode(IntEnum):
    """Opcodes that the check reads."""

    CTRL_POS = 0x11
    GET_POS = 0x22
    GET_CURR = 0x24
    GET_TEMP = 0x25
    SET_SPE = 0x31
    SET_TOR = 0x32


def words_of(frame: bytes) -> tuple[int, ...]:
    """Return the seven payload words of a frame, unsigned."""
    return FRAME.unpack(frame)[2:]
