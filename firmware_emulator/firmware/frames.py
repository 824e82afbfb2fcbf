"""Host frames: 16 bytes in both directions: opcode, filler, seven little-endian words; no checksum, no sync.

Words and servo counts are converted by the firmware's integer arithmetic, bit for bit. Divisions truncate toward zero.
The conversion to words uses a signed 32-bit product that wraps, and reads the position register as unsigned: a slightly
negative position is therefore reported at the wrong end.

Source: aero-open-firmware d7bd82e, `firmware_v0.1.0.ino`.
"""

from collections.abc import Sequence
from enum import IntEnum
from struct import Struct

FRAME_SIZE = 16
CHANNELS = 7
FULL = 65535
MAX_COUNTS = 4095
FRAME = Struct("<BB7H")
"""Layout of a frame: opcode, filler, seven words."""


class Opcode(IntEnum):
    """Opcodes known to the firmware; frames with any other opcode are dropped without a reply."""

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
    """Return a frame of up to seven words (unsigned, or signed 16-bit), padded with zeros."""
    payload = [word & 0xFFFF for word in words]
    return FRAME.pack(opcode, 0, *payload, *(0,) * (CHANNELS - len(payload)))


def divide(numerator: int, denominator: int) -> int:
    """Return the quotient truncated toward zero, as in C."""
    quotient = abs(numerator) // abs(denominator)
    return quotient if (numerator < 0) == (denominator < 0) else -quotient


def to_counts(word: int, extend: int, grasp: int) -> int:
    """Return the goal (counts, 0..4095) for a host word (0 = extended, 65535 = grasped)."""
    if extend == grasp == 0:
        return word * MAX_COUNTS // FULL
    return min(max(extend + divide(word * (grasp - extend), FULL), 0), MAX_COUNTS)


def to_word(counts: int, extend: int, grasp: int) -> int:
    """Return the smallest host word (0..65535) that `to_counts` maps to this goal, clipped to the window."""
    span = abs(grasp - extend)
    if not span:
        return 0
    inside = min(max((counts - extend) * (1 if grasp > extend else -1), 0), span)
    return -(-inside * FULL // span)


def to_host(position_word: int, extend: int, grasp: int) -> int:
    """Return the host word (0..65535) of a position register word, with its sign bit read as part of the number."""
    if grasp == extend:
        return 0
    product = (position_word - extend) * FULL
    if not -0x80000000 <= product <= 0x7FFFFFFF:
        product = (product + 0x80000000 & 0xFFFFFFFF) - 0x80000000
    # Exact: non-integer quotients of this magnitude differ from integers by more than the resolution of a double.
    word = int(product / (grasp - extend))
    return word if 0 <= word <= FULL else 0 if word < 0 else FULL
