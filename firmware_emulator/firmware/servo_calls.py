"""The firmware's calls to the servo library, with the library's argument types; tasks that need the bus to themselves.

Source: FTServo_Arduino v2.0.0 (64922cd), `HLSCL.cpp`.
"""

from __future__ import annotations

from struct import Struct

from firmware_emulator.kernel import Task
from firmware_emulator.servo.models import REGISTERS
from firmware_emulator.uart_master import UartMaster

GOAL_BLOCK = Struct("<BHHH")
"""Registers 41 to 47: acceleration, goal position, goal torque, goal speed."""
GOAL_ADDRESS = REGISTERS["acceleration"].address
FAILED = 32769
"""What a signed read returns when no answer came: -1 with its sign bit taken away."""


def int16(value: int) -> int:
    """Return a number as a signed 16-bit argument keeps it."""
    return (value + 0x8000 & 0xFFFF) - 0x8000


def sign_magnitude(value: int) -> int:
    """Return the register word of an int16, as the library forms it."""
    return value & 0xFFFF if value >= 0 else -value & 0xFFFF | 0x8000


def signed(word: int) -> int:
    """Return the value of a sign-magnitude register word."""
    return word if word < 0x8000 else 0x8000 - word


def goal(position: int, *, speed: int, acceleration: int, torque: int) -> bytes:
    """Return registers 41 to 47; the position is truncated to 16 bits first, which turns +-50000 around."""
    return GOAL_BLOCK.pack(acceleration, sign_magnitude(int16(position)), torque, speed)


def write_register(uart: UartMaster, servo: int, register: str, value: int) -> Task:
    """Write one register of one servo; return whether it was acknowledged."""
    row = REGISTERS[register]
    return uart.write(servo, row.address, value.to_bytes(row.size, "little"))


def read_signed(uart: UartMaster, servo: int, register: str) -> Task:
    """Return a signed register, `FAILED` when no answer came."""
    answer = yield from uart.read(servo, REGISTERS[register].address, 2)
    if answer is None:
        return FAILED
    return signed(int.from_bytes(answer, "little"))


def unlock(uart: UartMaster, servo: int) -> Task:
    """Open the EEPROM; the library switches the torque off first."""
    yield from write_register(uart, servo, "torque_enable", 0)
    yield from write_register(uart, servo, "lock", 0)


def calibrate(uart: UartMaster, servo: int) -> Task:
    """Make the present position 2048: four transactions that leave torque off and the EEPROM open.

    Return whether the last was acknowledged.
    """
    yield from write_register(uart, servo, "torque_enable", 0)
    yield from unlock(uart, servo)
    return (yield from uart.calibrate(servo))


def write_limits(uart: UartMaster, servo: int, low: int, high: int) -> Task:
    """Write the angle limits (counts) to EEPROM, lock it again and enable the torque."""
    yield from unlock(uart, servo)
    yield from write_register(uart, servo, "min_angle", low)
    yield from write_register(uart, servo, "max_angle", high)
    yield from write_register(uart, servo, "lock", 1)
    yield from write_register(uart, servo, "torque_enable", 1)
