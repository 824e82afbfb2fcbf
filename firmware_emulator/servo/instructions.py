"""Effect of each instruction on a servo, as a table; the bus handles addressing and the permission to answer."""

from collections.abc import Callable

from firmware_emulator.packets import Instruction
from firmware_emulator.servo.servo import Servo

ALWAYS_ANSWERED = frozenset({Instruction.PING, Instruction.READ})
"""Instructions answered even at response level 0."""
LONGEST_READ = 253
"""Most registers in one answer; their number plus two must fit into the length byte."""


def _ping(_servo: Servo, _parameters: bytes) -> bytes | None:
    return b""


def _read(servo: Servo, parameters: bytes) -> bytes | None:
    if len(parameters) != 2 or parameters[1] > LONGEST_READ:
        return None
    return servo.read(parameters[0], parameters[1])


def _write(servo: Servo, parameters: bytes) -> bytes | None:
    if len(parameters) < 2:
        return None
    servo.write(parameters[0], parameters[1:])
    return b""


def _reg_write(servo: Servo, parameters: bytes) -> bytes | None:
    if len(parameters) < 2:
        return None
    servo.hold_write(parameters[0], parameters[1:])
    return b""


def _action(servo: Servo, _parameters: bytes) -> bytes | None:
    servo.release_write()
    return b""


def _restore(servo: Servo, _parameters: bytes) -> bytes | None:
    servo.restore()
    return b""


def _reboot(servo: Servo, _parameters: bytes) -> bytes | None:
    servo.reboot()
    return None


def _reset(servo: Servo, _parameters: bytes) -> bytes | None:
    servo.forget_turns()
    return b""


def _calibrate(servo: Servo, parameters: bytes) -> bytes | None:
    if len(parameters) not in {0, 2}:
        return None
    servo.calibrate(int.from_bytes(parameters, "little") if parameters else None)
    return b""


EXECUTE: dict[int, Callable[[Servo, bytes], bytes | None]] = {
    Instruction.PING: _ping,
    Instruction.READ: _read,
    Instruction.WRITE: _write,
    Instruction.REG_WRITE: _reg_write,
    Instruction.ACTION: _action,
    Instruction.RESTORE: _restore,
    Instruction.REBOOT: _reboot,
    Instruction.RESET: _reset,
    Instruction.CALIBRATE: _calibrate,
}
"""Effect of each instruction; returns the answer's parameters, or None for no answer (malformed, or REBOOT)."""
