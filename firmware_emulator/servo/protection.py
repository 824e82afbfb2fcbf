"""Protections of a servo: status bits from its measurements, some of them latched.

Sources: transcribed HLS and STS memory tables. The HLS table has an overload bit without a threshold, so HLS servos
have no overload protection here. STS servos reduce the torque to a holding torque (register 34) after a load above the
overload torque (36) for the protection time (35).
"""

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


# Plain integers: combining enum members costs more than the whole check.
VOLTAGE, TEMPERATURE, CURRENT, OVERLOAD = (
    bit.value for bit in (Status.VOLTAGE, Status.TEMPERATURE, Status.CURRENT, Status.OVERLOAD)
)


COOLED_K = 10.0
"""Cooling below the maximum temperature (register 13) that ends a cut-out, K (assumption: the maker's FAQ says only
that a hot servo takes no command until it has cooled)."""


class Protection:
    """Check of the measurements; over-current, overload and temperature latch, voltage does not.

    A trip removes its own cause, so over-current and overload latch until the torque is enabled again; a new goal also
    clears the overload (assumptions). Over-temperature lasts until the servo has cooled by `COOLED_K`.
    """

    def __init__(self, model: ServoModel = HLS3606M) -> None:
        """Create the untripped protections of a servo model."""
        self._has_overload = model.has("holding_torque")
        self.hot = False
        """Whether the maximum temperature was exceeded and the servo has not cooled since."""
        self.release()

    def release(self) -> None:
        """Clear over-current and overload."""
        self._over_current_s = self._overload_s = 0.0
        self._tripped = False
        self.overloaded = False
        """Whether an overload has tripped, which limits the torque to the holding torque."""

    def status(self, memory: RegisterFile, seconds: float) -> int:
        """Return the bits of `Status` for the present measurements, `seconds` after the last check."""
        status = 0
        voltage = memory.get("present_voltage")
        if not memory.get("min_voltage") <= voltage <= memory.get("max_voltage"):
            status |= VOLTAGE
        below = memory.get("max_temperature") - memory.get("present_temperature")
        self.hot = below < (COOLED_K if self.hot else 0.0)
        if self.hot:
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
