"""An emulated hand as hands, eyes and instruments of its owner find it, each part beside how it was when healthy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from aero.channels import Channel
from firmware_emulator.servo.models import REGISTERS
from hil.faults.assembly import HandAssembly
from hil.faults.fault import Injection
from hil.faults.mechanics import JOINTS
from hil.faults.servo import servo_of
from hil.faults.winding import NEIGHBOUR


@dataclass(frozen=True)
class Noticed:
    """What a person notices of a digit that is bent and looked at, beside how it was when it was well."""

    field: str
    """Of `model.units`' hand."""
    words: str
    differs: Callable[[float, float], bool]
    """Whether a value now and one of the healthy hand differ so that it is noticed."""


NOTICED = (
    Noticed("joint_friction", "it bends with more resistance", lambda now, was: now > was + 0.04),
    Noticed("spring_open", "it springs back otherwise", lambda now, was: abs(now - was) > 0.35 * was),
    Noticed("closed_stop", "it stops elsewhere", lambda now, was: abs(now - was) > 0.12),
    Noticed("cable_take_up", "its cable is slack or tight", lambda now, was: abs(now - was) > 4e-3),
)
"""Friction, N m; springs; stops, rad; a slack cable, m."""
MOVES = ("goal_position", "goal_speed", "goal_torque", "acceleration")
"""Registers that the board writes while it moves the hand."""
FEEDBACK = REGISTERS["present_position"].address
"""Registers from here on are measurements."""
MOST = 5
"""Servos that are set alike, of seven, where one differs."""
ALIKE = "nothing differs"


def seen_of_digit(assembly: HandAssembly, wound: Iterable[Channel], channel: Channel) -> tuple[str, ...]:
    """Return what differs of a digit that is bent by hand and looked at; empty for nothing.

    `wound` are the channels whose cables lie otherwise on their spools.
    """
    now, was = assembly.unit.hand, assembly.healthy.hand
    found = []
    for one in NOTICED:
        places = [channel] if len(getattr(was, one.field)) == len(Channel) else JOINTS[channel]
        if any(one.differs(getattr(now, one.field)[place], getattr(was, one.field)[place]) for place in places):
            found.append(one.words)
    if channel in wound:
        found.append("its cable lies otherwise on its spool")
    return tuple(found)


def cables_of(fault: Injection) -> tuple[Channel, ...]:
    """Return the channels whose cables a fault of winding is about."""
    return (
        (fault.where,) if fault.name == "winding_reversed" else (fault.where, NEIGHBOUR.get(fault.where, fault.where))
    )


def odd_registers(assembly: HandAssembly) -> tuple[str, ...]:
    """Return which servos are set otherwise than most, register by register, and IDs that are there twice."""
    memories = {channel: servo_of(assembly.hand, channel).memory for channel in Channel}
    ids = [memory.get("id") for memory in memories.values()]
    found = [f"the ID {number} is there twice" for number in sorted(set(ids)) if ids.count(number) > 1]
    rows = [name for name, row in REGISTERS.items() if row.address < FEEDBACK and name not in ("id", *MOVES)]
    for name in rows:
        values = [memory.get(name) for memory in memories.values()]
        usual = max(values, key=values.count)
        if values.count(usual) >= MOST:
            odd = [(channel, value) for channel, value in zip(memories, values, strict=True) if value != usual]
            found += [f"{channel.label}: {name} is {value}, {usual} in the others" for channel, value in odd]
    return tuple(found)


def volts_off(assembly: HandAssembly, volts: float) -> float:
    """Return by what share a meter shows another voltage than a healthy supply would give under the same load."""
    now, was = assembly.unit.hand, assembly.healthy.hand
    lost = 1.0 - assembly.mechanics.compiled.supply / now.supply_ratio
    usual = was.supply_ratio * (1.0 - (lost * was.supply_sag / now.supply_sag if now.supply_sag else 0.0))
    return volts / (assembly.healthy.servos.voltage * usual) - 1.0


def in_words(what: str, found: Sequence[str]) -> str:
    """Return what was found, for people."""
    return f"{what}: {'; '.join(found) or ALIKE}"
