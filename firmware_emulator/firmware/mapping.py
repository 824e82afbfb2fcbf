"""The firmware's integer arithmetic between host words and servo counts, to the bit.

Divisions truncate toward zero, and the way back is a signed 32-bit product that wraps: a slightly negative position,
whose register word is read as unsigned, comes out at the wrong end. Source: aero-open-firmware d7bd82e.
"""

from __future__ import annotations

FULL = 65535
MAX_COUNTS = 4095


def divide(numerator: int, denominator: int) -> int:
    """Integer division that truncates toward zero, as in C."""
    quotient = abs(numerator) // abs(denominator)
    return quotient if (numerator < 0) == (denominator < 0) else -quotient


def to_counts(word: int, extend: int, grasp: int) -> int:
    """Return the goal (counts, 0..4095) for a host word (0 = extended, 65535 = grasped)."""
    if extend == grasp == 0:
        return word * MAX_COUNTS // FULL
    return min(max(extend + divide(word * (grasp - extend), FULL), 0), MAX_COUNTS)


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
