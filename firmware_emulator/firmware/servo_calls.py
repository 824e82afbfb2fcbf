"""Servo library calls of the firmware, with the library's argument types, as tasks that need exclusive bus access.

Source: FTServo_Arduino v2.0.0 (64922cd), `HLSCL.cpp`.
"""

from struct import Struct

from firmware_emulator.kernel import Task
from firmware_emulator.servo.models import REGISTERS
from firmware_emulator.uart_master import UartMaster

GOAL_BLOCK = Struct("<BHHH")
"""Registers 41 to 47: acceleration, goal position, goal torque, goal speed."""
GOAL_ADDRESS = REGISTERS["acceleration"].address
FAILED = 32769
"""Result of a signed read without an answer: -1 with its sign bit cleared."""


def int16(value: int) -> int:
    """Return a number wrapped to a signed 16-bit argument."""
    return (value + 0x8000 & 0xFFFF) - 0x8000


def sign_magnitude(value: int) -> int:
    """Return the sign-magnitude register word of an int16, as computed by the library."""
    return value & 0xFFFF if value >= 0 else -value & 0xFFFF | 0x8000


def signed(word: int) -> int:
    """Return the value of a sign-magnitude register word."""
    return word if word < 0x8000 else 0x8000 - word


def goal(position: int, *, speed: int, acceleration: int, torque: int) -> bytes:
    """Return registers 41 to 47; the position first wraps to 16 bits, which reverses the sign of +-50000."""
    return GOAL_BLOCK.pack(acceleration, sign_magnitude(int16(position)), torque, speed)


def write_register(uart: UartMaster, servo: int, register: str, value: int) -> Task:
    """Write one register of one servo; return whether the servo acknowledged."""
    row = REGISTERS[register]
    return uart.write(servo, row.address, value.to_bytes(row.size, "little"))


def read_signed(uart: UartMaster, servo: int, register: str) -> Task:
    """Return the value of a signed register, or `FAILED` without an answer."""
    answer = yield from uart.read(servo, REGISTERS[register].address, 2)
    if answer is None:
        return FAILED
    return signed(int.from_bytes(answer, "little"))


def unlock(uart: UartMaster, servo: int) -> Task:
    """Switch the torque off and unlock the EEPROM, as the library does."""
    yield from write_register(uart, servo, "torque_enable", 0)
    yield from write_register(uart, servo, "lock", 0)


def calibrate(uart: UartMaster, servo: int) -> Task:
    """Make the present position 2048, in four transactions; torque stays off and the EEPROM unlocked.

    Return whether the servo acknowledged the last transaction.
    """
    yield from write_register(uart, servo, "torque_enable", 0)
    yield from unlock(uart, servo)
    return (yield from uart.calibrate(servo))


def write_limits(uart: UartMaster, servo: int, low: int, high: int) -> Task:
    """Write the angle limits (counts), lock the EEPROM again and enable the torque."""
    yield from unlock(uart, servo)
    yield from write_register(uart, servo, "min_angle", low)
    yield from write_register(uart, servo, "max_angle", high)
    yield from write_register(uart, servo, "lock", 1)
    yield from write_register(uart, servo, "torque_enable", 1)
