"""Servo faults: registers, ID, temperature, presence on the bus."""

import math
from collections.abc import Callable

from aero.channels import FINGERS, WIRE_ORDER, Channel
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.servo.models import REGISTERS
from firmware_emulator.servo.servo import Servo
from hil.emulated.faults.assembly import Active, HandAssembly
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Inject, Injection, Severity
from hil.emulated.faults.winding import NEIGHBOUR
from hil.verdict.part import Part

SERVO = FaultLayer.SERVO
THUMB_ID_NEIGHBOUR = {
    Channel.THUMB_ABDUCTION: Channel.THUMB_CMC_FLEXION,
    Channel.THUMB_CMC_FLEXION: Channel.THUMB_FLEXOR,
}
UNLOCKED, LOCKED = b"\0", b"\1"
COOL_C = 30.0
"""Temperature of a servo after cooling, °C."""


def servo_of(electronics: EmulatedHand, channel: Channel) -> Servo:
    """Return the servo that was built in at a channel."""
    return electronics.servos[WIRE_ORDER.index(channel)]


def store(servo: Servo, register: str, value: int) -> None:
    """Write a register permanently, as a bus adapter does."""
    row = REGISTERS[register]
    servo.write(REGISTERS["lock"].address, UNLOCKED)
    servo.write(row.address, value.to_bytes(row.size, "little"))
    servo.write(REGISTERS["lock"].address, LOCKED)


def stored(register: str, value: Callable[[int, float], int]) -> Inject:
    """Return an injector that stores a wrong register value; `value` maps the right one and the severity to it."""

    def inject(assembly: HandAssembly, fault: Injection) -> Active:
        servo = servo_of(assembly.electronics, fault.where)
        right = servo.memory.get(register)
        return Active(
            lambda: store(servo, register, value(right, fault.severity)), lambda: store(servo, register, right)
        )

    return inject


def _exchange(assembly: HandAssembly, fault: Injection) -> Active:
    neighbour = (THUMB_ID_NEIGHBOUR | {f: NEIGHBOUR[f] for f in FINGERS[:3]})[fault.where]
    one, other = servo_of(assembly.electronics, fault.where), servo_of(assembly.electronics, neighbour)

    def exchange() -> None:
        first, second = one.id, other.id
        store(one, "id", second)
        store(other, "id", first)

    return Active(exchange, exchange)


def _double(assembly: HandAssembly, fault: Injection) -> Active:
    servos = assembly.electronics.servos
    at = WIRE_ORDER.index(fault.where)
    right, wrong = servos[at].id, servos[(at + 1) % len(servos)].id
    return Active(lambda: store(servos[at], "id", wrong), lambda: store(servos[at], "id", right))


def _missing(assembly: HandAssembly, fault: Injection) -> Active:
    servo = servo_of(assembly.electronics, fault.where)
    return Active(lambda: setattr(servo, "silent_until", math.inf), lambda: setattr(servo, "silent_until", -1.0))


def _hot(assembly: HandAssembly, fault: Injection) -> Active:
    servo = servo_of(assembly.electronics, fault.where)
    return Active(lambda: servo.heat_to(fault.severity), lambda: servo.heat_to(COOL_C))


# fmt: off
FAULTS = (
    Fault("servo_missing", SERVO, Part.BUS, "a servo is not on the bus", _missing, ALL, alike=(Part.SERVO,)),
    Fault("servo_id_doubled", SERVO, Part.SERVO, "duplicate servo ID", _double, ALL, excludes="id"),
    Fault("finger_ids_exchanged", SERVO, Part.SERVO, "two fingers' IDs are exchanged",
          _exchange, FINGERS[:3], excludes="id"),
    Fault("thumb_ids_exchanged", SERVO, Part.SERVO, "the IDs of two thumb servos are exchanged",
          _exchange, tuple(THUMB_ID_NEIGHBOUR), excludes="id"),
    Fault("servo_hot", SERVO, Part.SERVO, "a servo is hot", _hot, ALL, Severity("°C", (55, 65, 78), 0, 120)),
    Fault("protection_low", SERVO, Part.SERVO, "a servo's protection current is set low",
          stored("protection_current", lambda right, severity: round(severity)),
          ALL, Severity("units of 6.5 mA", (400, 200, 60), 0, 1023)),
)
# fmt: on
