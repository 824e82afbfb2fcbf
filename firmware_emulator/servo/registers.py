"""The HLS register map as data.

Sources: `A` = FTServo_Arduino v2.0.0 `HLSCL.h` and the transcribed HLS memory table (vassar-robotics/feetech-servo-sdk
d60242c, `docs/reference`); `B` = the transcribed table only; `C` = another series or an assumption, listed in
`docs/electronics.md`. Addresses below 40 are EEPROM, 40 to 55 RAM, 56 and above measurements and factory data.
"""

from __future__ import annotations

from typing import NamedTuple

MEMORY_SIZE = 128
EEPROM_END = 40
FEEDBACK = 56
FEEDBACK_SIZE = 15


class Register(NamedTuple):
    """One row of the map."""

    name: str
    """Lower-case name."""
    address: int
    """Address of the low byte."""
    size: int
    """Bytes, 1 or 2, low byte first."""
    writable: bool
    """Whether a write has an effect; others are acknowledged and ignored."""
    low: int
    """Smallest value (magnitude for signed registers); smaller ones are stored as this."""
    high: int
    """Largest value (magnitude for signed registers); larger ones are stored as this."""
    default: int
    """Factory value."""
    unit: str
    """Unit of one count of the register."""
    confidence: str
    """A, B or C, see the module."""
    signed: bool = False
    """Whether bit 15 is a sign."""


REGISTERS: dict[str, Register] = {
    register.name: register
    for register in (
        Register("firmware_major", 0, 1, False, 0, 255, 3, "", "B"),
        Register("firmware_minor", 1, 1, False, 0, 255, 43, "", "C"),
        Register("endianness", 2, 1, False, 0, 1, 0, "0 = little", "B"),
        Register("model_major", 3, 1, False, 0, 255, 10, "", "A"),
        Register("model_minor", 4, 1, False, 0, 255, 10, "10 = HLS3606", "A"),
        Register("id", 5, 1, True, 0, 253, 1, "", "A"),
        Register("baud", 6, 1, True, 0, 7, 0, "0 = 1 Mbit/s", "A"),
        Register("secondary_id", 7, 1, True, 0, 253, 0, "0 = none", "A"),
        Register("response_level", 8, 1, True, 0, 1, 1, "0 = ping and read only", "B"),
        Register("min_angle", 9, 2, True, 0, 4094, 0, "counts", "A"),
        Register("max_angle", 11, 2, True, 0, 4095, 4095, "counts", "A"),
        Register("max_temperature", 13, 1, True, 0, 100, 70, "°C", "B"),
        Register("max_voltage", 14, 1, True, 0, 254, 90, "0.1 V", "C"),
        Register("min_voltage", 15, 1, True, 0, 254, 40, "0.1 V", "B"),
        Register("max_torque", 16, 2, True, 0, 1000, 980, "0.1 %", "B"),
        Register("phase", 18, 1, True, 0, 255, 0x10, "bits, b4 = multi-turn feedback", "C"),
        Register("unload_conditions", 19, 1, True, 0, 255, 0x2C, "status bits", "C"),
        Register("alarm_conditions", 20, 1, True, 0, 255, 0x2F, "status bits", "C"),
        Register("position_p", 21, 1, True, 0, 254, 32, "", "C"),
        Register("position_d", 22, 1, True, 0, 254, 32, "", "C"),
        Register("position_i", 23, 1, True, 0, 254, 0, "", "B"),
        Register("min_start_force", 24, 1, True, 0, 254, 0, "0.1 %", "C"),
        Register("integral_limit", 25, 1, True, 0, 254, 0, "x 4", "B"),
        Register("dead_zone_cw", 26, 1, True, 0, 16, 1, "counts", "A"),
        Register("dead_zone_ccw", 27, 1, True, 0, 16, 1, "counts", "A"),
        Register("protection_current", 28, 2, True, 0, 2047, 1023, "6.5 mA", "B"),
        Register("angle_resolution", 30, 1, True, 1, 128, 1, "", "B"),
        Register("offset", 31, 2, True, 0, 4095, 0, "counts", "C", signed=True),
        Register("mode", 33, 1, True, 0, 3, 0, "", "A"),
        Register("current_p", 34, 1, True, 0, 254, 0, "", "C"),
        Register("current_i", 35, 1, True, 0, 254, 0, "", "C"),
        Register("reserved_36", 36, 1, True, 0, 255, 0, "", "B"),
        Register("speed_p", 37, 1, True, 0, 254, 0, "", "C"),
        Register("over_current_time", 38, 1, True, 0, 254, 200, "10 ms", "B"),
        Register("speed_i", 39, 1, True, 0, 254, 0, "", "C"),
        Register("torque_enable", 40, 1, True, 0, 2, 0, "0 off, 1 on, 2 damping", "A"),
        Register("acceleration", 41, 1, True, 0, 254, 0, "100 counts/s², 0 = motor", "A"),
        Register("goal_position", 42, 2, True, 0, 32767, 0, "counts", "A", signed=True),
        Register("goal_torque", 44, 2, True, 0, 2047, 1023, "6.5 mA", "A", signed=True),
        Register("goal_speed", 46, 2, True, 0, 32767, 32766, "50 counts/s", "A", signed=True),
        Register("torque_limit", 48, 2, True, 0, 1000, 1000, "0.1 %", "A"),
        Register("kp", 50, 1, True, 0, 254, 32, "", "C"),
        Register("kd", 51, 1, True, 0, 254, 32, "", "C"),
        Register("ki", 52, 1, True, 0, 254, 0, "", "C"),
        Register("km", 53, 1, True, 0, 1, 0, "", "B"),
        Register("lock", 55, 1, True, 0, 1, 1, "0 = EEPROM writes are kept", "A"),
        Register("present_position", 56, 2, False, 0, 32767, 0, "counts", "A", signed=True),
        Register("present_speed", 58, 2, False, 0, 32767, 0, "50 counts/s", "A", signed=True),
        Register("present_load", 60, 2, False, 0, 1023, 0, "0.1 %, sign bit 10", "A"),
        Register("present_voltage", 62, 1, False, 0, 255, 60, "0.1 V", "A"),
        Register("present_temperature", 63, 1, False, 0, 255, 25, "°C", "A"),
        Register("async_flag", 64, 1, False, 0, 1, 0, "", "B"),
        Register("status", 65, 1, False, 0, 255, 0, "status bits", "B"),
        Register("moving", 66, 1, False, 0, 3, 0, "b0 moving, b1 goal not reached", "A"),
        Register("target_position", 67, 2, False, 0, 32767, 0, "counts", "B", signed=True),
        Register("present_current", 69, 2, False, 0, 2047, 0, "6.5 mA", "A", signed=True),
        Register("moving_threshold", 80, 1, False, 0, 255, 1, "50 counts/s", "C"),
        Register("max_speed", 84, 1, False, 0, 255, 166, "50 counts/s", "C"),
    )
}

POWER_UP_COPIES = {
    "protection_current": "goal_torque",
    "position_p": "kp",
    "position_d": "kd",
    "position_i": "ki",
}
"""EEPROM register to the RAM register it is copied to at power-up.

The table also names max_torque -> torque_limit. Its default of 98 % would cost 2 % of the free speed that the units
were fitted with, so that copy is left out (`docs/electronics.md`, assumptions); homing meets its stops either way.
"""


def span(first: str, last: str | None = None) -> range:
    """Return the addresses from one register to another, or those of one."""
    end = REGISTERS[last or first]
    return range(REGISTERS[first].address, end.address + end.size)


REGISTER_AT: dict[int, Register] = {register.address: register for register in REGISTERS.values()}
