"""Manual, visual and instrument inspection of an emulated hand, compared with the healthy hand."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from aero.channels import Channel
from hil.emulated.faults.assembly import HandAssembly
from hil.emulated.faults.fault import Injection
from hil.emulated.faults.mechanics import JOINTS
from hil.emulated.faults.winding import NEIGHBOUR


@dataclass(frozen=True)
class Noticed:
    """Property that a person notices when bending a digit."""

    field: str
    """Field of the `model.units` hand."""
    words: str
    differs: Callable[[float, float], bool]
    """Predicate on the present and the healthy value: True for a noticeable difference."""


NOTICED = (
    Noticed("joint_friction", "it bends with more resistance", lambda now, was: now > was + 0.04),
    Noticed("spring_open", "it springs back otherwise", lambda now, was: abs(now - was) > 0.35 * was),
    Noticed("closed_stop", "it stops elsewhere", lambda now, was: abs(now - was) > 0.12),
)
"""Noticeable differences: friction, N m; springs, fraction; stops, rad."""
SLACK_M = 4e-3
"""Threshold of cable length error, m; above it the cable visibly looks slack or tight."""
FREE_M = 0.05
"""Threshold of cable length error, m; above it the digit is bent as without a cable."""
NOT_SET = 0
"""Register value of an unset secondary ID."""
SAME = "nothing differs"


def felt_of_digit(assembly: HandAssembly, channel: Channel) -> tuple[str, ...]:
    """Return the differences from the healthy hand that are felt when bending a digit; empty for none."""
    now, was = assembly.unit.hand, assembly.healthy.hand
    free = now.cable_take_up[channel] - was.cable_take_up[channel] > FREE_M
    return (
        *["it is loose, as without its cable"] * free,
        *(
            one.words
            for one in NOTICED
            if any(one.differs(getattr(now, one.field)[at], getattr(was, one.field)[at]) for at in JOINTS[channel])
        ),
    )


def seen_of_cable(assembly: HandAssembly, wound: Iterable[Channel], channel: Channel) -> tuple[str, ...]:
    """Return the differences seen along a cable from spool to tip; `wound` are the channels with a winding fault."""
    longer_m = assembly.unit.hand.cable_take_up[channel] - assembly.healthy.hand.cable_take_up[channel]
    found = [f"its cable is {'slack' if longer_m > 0 else 'tight'}"] if abs(longer_m) > SLACK_M else []
    return (*found, *(("its cable lies otherwise on its spool",) if channel in wound else ()))


def odd_on_bus(assembly: HandAssembly) -> tuple[str, ...]:
    """Return sentences on the IDs that do not answer a bus adapter or answer twice."""
    answering = []
    for servo in assembly.electronics.servos:
        if servo.silent_until <= assembly.now() and servo.memory.get("baud") == servo.model.places["baud"].default:
            own, other = servo.memory.get("id"), servo.memory.get("secondary_id")
            answering += [own, *([other] if other not in (own, NOT_SET) else [])]
    silent = [f"ID {number} does not answer" for number in range(len(Channel)) if number not in answering]
    return (
        *silent,
        *(f"ID {number} answers twice" for number in sorted(set(answering)) if answering.count(number) > 1),
    )


def cables_of(fault: Injection) -> tuple[Channel, ...]:
    """Return the channels whose cables a winding fault affects."""
    return (
        (fault.where,) if fault.name == "winding_reversed" else (fault.where, NEIGHBOUR.get(fault.where, fault.where))
    )


def in_words(what: str, found: Sequence[str]) -> str:
    """Return the findings of an inspection as one sentence."""
    return f"{what}: {'; '.join(found) or SAME}"
