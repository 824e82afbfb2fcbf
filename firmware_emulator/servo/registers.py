"""The registers of the hand's servo, for the firmware that drives it.

Addresses below 40 are EEPROM, 40 to 55 RAM, 56 and above measurements and factory data.
"""

from __future__ import annotations

from firmware_emulator.servo.models import HLS3606M

FEEDBACK_SIZE = 15
"""Bytes of the measurements, from `FEEDBACK`, that the firmware reads in one go."""
REGISTERS = HLS3606M.registers
"""Rows by name."""


# Signed numbers stand as sign and magnitude, with the sign in bit 15, or in bit 10 for the load.
def encode_signed(value: int, sign_bit: int = 15) -> int:
    """Return the register word of a signed value.

    Raises:
        ValueError: the magnitude does not fit below the sign bit.
    """
    limit = (1 << sign_bit) - 1
    if not -limit <= value <= limit:
        raise ValueError(f"{value} does not fit a sign-magnitude word with sign bit {sign_bit}: limit is +-{limit}")
    return value if value >= 0 else -value | 1 << sign_bit


def decode_signed(word: int, sign_bit: int = 15) -> int:
    """Return the signed value of a register word; bits above the sign bit are ignored, as the libraries do.

    Raises:
        ValueError: the word is not a 16-bit one.
    """
    if not 0 <= word <= 0xFFFF:
        raise ValueError(f"{word} is not a 16-bit register word")
    magnitude = word & (1 << sign_bit) - 1
    return -magnitude if word >> sign_bit & 1 else magnitude
