"""A servo's protections: which status bits its measurements set, and whether they cut the torque.

Sources: transcribed HLS memory table. Overload (0x20) is left out: its thresholds are documented nowhere.
"""

from __future__ import annotations

from enum import IntFlag

from firmware_emulator.servo.memory import RegisterFile


class Status(IntFlag):
    """Bits of the error byte and of the status register."""

    VOLTAGE = 0x01
    ENCODER = 0x02
    TEMPERATURE = 0x04
    CURRENT = 0x08
    OVERLOAD = 0x20


class Protection:
    """Watches the measurements; only the over-current rule has a memory.

    Cutting the torque ends the current that was too high, so its bit stays until the torque is enabled again
    (assumption); temperature and voltage speak for themselves.
    """

    def __init__(self) -> None:
        self._over_current_s = 0.0
        self._tripped = False

    def release(self) -> None:
        """Forget an over-current, because the torque is enabled anew."""
        self._tripped = False
        self._over_current_s = 0.0

    def status(self, memory: RegisterFile, seconds: float) -> Status:
        """Return the bits for the present measurements, `seconds` after the last look."""
        status = Status(0)
        voltage = memory.get("present_voltage")
        if not memory.get("min_voltage") <= voltage <= memory.get("max_voltage"):
            status |= Status.VOLTAGE
        if memory.get("present_temperature") > memory.get("max_temperature"):
            status |= Status.TEMPERATURE
        over = abs(memory.get("present_current")) > memory.get("protection_current")
        self._over_current_s = self._over_current_s + seconds if over else 0.0
        self._tripped |= over and self._over_current_s >= 0.01 * memory.get("over_current_time")
        if self._tripped:
            status |= Status.CURRENT
        return status
