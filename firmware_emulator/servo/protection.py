"""A servo's protections: which status bits its measurements set, and which of them stay.

Sources: transcribed HLS and STS memory tables. The HLS table names an overload bit and no threshold for it, so that an
HLS servo has none here. The STS table has three registers: above an overload torque (36) for a protection time (35), a
holding torque (34) is left.
"""

from __future__ import annotations

from enum import IntFlag

from firmware_emulator.servo.memory import RegisterFile
from firmware_emulator.servo.model_file import ServoModel
from firmware_emulator.servo.models import HLS3606M


class Status(IntFlag):
    """Bits of the error byte and of the status register."""

    VOLTAGE = 0x01
    ENCODER = 0x02
    TEMPERATURE = 0x04
    CURRENT = 0x08
    OVERLOAD = 0x20


# Plain numbers: what combines members of an enumeration costs more than the whole check.
VOLTAGE, TEMPERATURE, CURRENT, OVERLOAD = (
    bit.value for bit in (Status.VOLTAGE, Status.TEMPERATURE, Status.CURRENT, Status.OVERLOAD)
)


class Protection:
    """Watches the measurements; over-current and overload have a memory.

    Both end what was too high, so their bits stay until the torque is enabled again, that of the overload until another
    goal comes too (assumptions); temperature and voltage speak for themselves.
    """

    def __init__(self, model: ServoModel = HLS3606M) -> None:
        """Watch a servo of a model."""
        self._has_overload = model.has("holding_torque")
        self.release()

    def release(self) -> None:
        """Forget over-current and overload, because the torque is enabled again."""
        self._over_current_s = self._overload_s = 0.0
        self._tripped = False
        self.overloaded = False
        """Whether an overload leaves the holding torque alone."""

    def status(self, memory: RegisterFile, seconds: float) -> int:
        """Return the bits of `Status` for the present measurements, `seconds` after the last check."""
        status = 0
        voltage = memory.get("present_voltage")
        if not memory.get("min_voltage") <= voltage <= memory.get("max_voltage"):
            status |= VOLTAGE
        if memory.get("present_temperature") > memory.get("max_temperature"):
            status |= TEMPERATURE
        over = abs(memory.get("present_current")) > memory.get("protection_current")
        self._over_current_s = self._over_current_s + seconds if over else 0.0
        self._tripped |= over and self._over_current_s >= 0.01 * memory.get("over_current_time")
        if self._tripped:
            status |= CURRENT
        if self._has_overload:
            self._look_for_overload(memory, seconds)
        if self.overloaded:
            status |= OVERLOAD
        return status

    def _look_for_overload(self, memory: RegisterFile, seconds: float) -> None:
        threshold, patience = memory.get("overload_torque"), memory.get("overload_time")
        load = abs(memory.get("present_load"))
        over = load > 10 * threshold and bool(memory.get("unload_conditions") & OVERLOAD)
        self._overload_s = self._overload_s + seconds if over else 0.0
        self.overloaded |= over and self._overload_s >= 0.01 * patience - 1e-9
