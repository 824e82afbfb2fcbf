"""The registers of the hand's servo, for the firmware that drives it.

Addresses below 40 are EEPROM, 40 to 55 RAM, 56 and above measurements and factory data.
"""

from __future__ import annotations

from firmware_emulator.servo.models import HLS3606M

FEEDBACK_SIZE = 15
"""Bytes of the measurements, from `FEEDBACK`, that the firmware reads in one go."""
REGISTERS = HLS3606M.registers
"""Rows by name."""
