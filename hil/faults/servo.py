"""Faults of a servo: its registers, its ID, its temperature, its presence on the bus."""

from __future__ import annotations

import math

from aero.channels import WIRE_ORDER, Channel
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.servo.registers import REGISTERS
from firmware_emulator.servo.servo import Servo
from hil.faults.assembly import Injector, at_once
from hil.faults.fault import ALL, FINGERS, ONCE, SWITCH, Fault, Kind
from hil.faults.motor import FINGERS_ALIKE, NEIGHBOUR

THUMB_ID_NEIGHBOUR = {
    Channel.THUMB_ABDUCTION: Channel.THUMB_CMC_FLEXION,
    Channel.THUMB_CMC_FLEXION: Channel.THUMB_FLEXOR,
}
UNLOCKED, LOCKED = b"\0", b"\1"


def servo_of(hand: EmulatedHand, channel: Channel | None) -> Servo:
    """Return the servo that a channel was built with."""
    assert channel is not None
    return hand.servos[WIRE_ORDER.index(channel)]


def _store(servo: Servo, register: str, value: int) -> None:
    """Write a register for good, as a bus adapter does."""
    row = REGISTERS[register]
    servo.write(REGISTERS["lock"].address, UNLOCKED)
    servo.write(row.address, value.to_bytes(row.size, "little"))
    servo.write(REGISTERS["lock"].address, LOCKED)


def _exchange(hand: EmulatedHand, fault: Fault) -> None:
    assert fault.channel is not None
    neighbour = (THUMB_ID_NEIGHBOUR | {f: NEIGHBOUR[f] for f in FINGERS[:3]})[fault.channel]
    one, other = servo_of(hand, fault.channel), servo_of(hand, neighbour)
    first, second = one.id, other.id
    _store(one, "id", second)
    _store(other, "id", first)


def _double(hand: EmulatedHand, fault: Fault) -> None:
    assert fault.channel is not None
    at = WIRE_ORDER.index(fault.channel)
    _store(hand.servos[at], "id", hand.servos[(at + 1) % len(hand.servos)].id)


def _missing(hand: EmulatedHand, fault: Fault) -> None:
    servo_of(hand, fault.channel).silent_until = math.inf


def _hot(hand: EmulatedHand, fault: Fault) -> None:
    servo_of(hand, fault.channel).heat_to(fault.severity)


def _protection(hand: EmulatedHand, fault: Fault) -> None:
    _store(servo_of(hand, fault.channel), "protection_current", round(fault.severity))


KINDS = (
    Kind(
        "servo_missing",
        "bus",
        ("C1", "C5", "B10", "A17", "C12"),
        "",
        SWITCH,
        "a servo is not on the bus",
        ALL,
        cause="servo_not_answering",
        bounds=ONCE,
    ),
    Kind(
        "servo_id_doubled",
        "bus",
        ("C4",),
        "",
        SWITCH,
        "a servo has its neighbour's ID too",
        ALL,
        cause="servo_not_answering",
        bounds=ONCE,
        excludes="id",
    ),
    Kind(
        "finger_ids_exchanged",
        "bus",
        ("D21",),
        "",
        SWITCH,
        "two fingers' IDs are exchanged",
        FINGERS[:3],
        cause="fingers_exchanged",
        bounds=ONCE,
        excludes="id",
        visible=False,
        reason=FINGERS_ALIKE,
    ),
    Kind(
        "thumb_ids_exchanged",
        "bus",
        ("D21",),
        "",
        SWITCH,
        "the IDs of two thumb servos are exchanged",
        tuple(THUMB_ID_NEIGHBOUR),
        bounds=ONCE,
        excludes="id",
    ),
    Kind("servo_hot", "servo", ("D12", "C3"), "°C", (55, 65, 78), "a servo is hot", ALL, bounds=(0, 120)),
    Kind(
        "protection_low",
        "servo",
        ("C3", "D12"),
        "6.5 mA",
        (400, 200, 60),
        "a servo's protection current is set low",
        ALL,
        bounds=(0, 1023),
    ),
)
INJECTORS: dict[str, Injector] = {
    "servo_missing": at_once(_missing),
    "servo_id_doubled": at_once(_double),
    "finger_ids_exchanged": at_once(_exchange),
    "thumb_ids_exchanged": at_once(_exchange),
    "servo_hot": at_once(_hot),
    "protection_low": at_once(_protection),
}
