"""Host frames: 16 bytes both ways, opcode, filler, seven little-endian words in wire order; no checksum, no sync.

Between words and servo counts stands the firmware's integer arithmetic, to the bit. Divisions truncate toward zero, and
the way back is a signed 32-bit product that wraps: a slightly negative position, whose register word is read as
unsigned, comes out at the wrong end.

Source: aero-open-firmware d7bd82e, `firmware_v0.1.0.ino`.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from struct import Struct

FRAME_SIZE = 16
CHANNELS = 7
FULL = 65535
MAX_COUNTS = 4095
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


def divide(numerator: int, denominator: int) -> int:
    """Integer division that truncates toward zero, as in C."""
    quotient = abs(numerator) // abs(denominator)
    return quotient if (numerator < 0) == (denominator < 0) else -quotient


def to_counts(word: int, extend: int, grasp: int) -> int:
    """Return the goal (counts, 0..4095) for a host word (0 = extended, 65535 = grasped)."""
    if extend == grasp == 0:
        return word * MAX_COUNTS // FULL
    return min(max(extend + divide(word * (grasp - extend), FULL), 0), MAX_COUNTS)


def to_word(counts: int, extend: int, grasp: int) -> int:
    """Return the host word (0..65535) of a goal: the smallest for which `to_counts` gives this goal, in the window."""
    span = abs(grasp - extend)
    if not span:
        return 0
    inside = min(max((counts - extend) * (1 if grasp > extend else -1), 0), span)
    return -(-inside * FULL // span)


def to_host(position_word: int, extend: int, grasp: int) -> int:
    """Return the host word (0..65535) for a position register word, sign bit and all."""
    if grasp == extend:
        return 0
    product = (position_word - extend) * FULL
    if not -0x80000000 <= product <= 0x7FFFFFFF:
        product = (product + 0x80000000 & 0xFFFFFFFF) - 0x80000000
    # Exact: a quotient of these sizes is never closer to a whole number than a double can tell.
    word = int(product / (grasp - extend))
    return word if 0 <= word <= FULL else 0 if word < 0 else FULL
