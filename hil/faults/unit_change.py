"""Faults that are another unit: what the mechanics of a hand are made of, as functions from a unit to a unit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from aero.channels import FINGERS, Channel, Joint
from hil.faults.fault import Inject, Injection
from model.units import Unit

UnitChange = Callable[[Unit, Injection], Unit]

JOINTS: dict[Channel, tuple[Joint, ...]] = {
    **{finger: (Joint(3 * finger), Joint(3 * finger + 1), Joint(3 * finger + 2)) for finger in FINGERS},
    Channel.THUMB_ABDUCTION: (Joint.THUMB_ABDUCTION,),
    Channel.THUMB_CMC_FLEXION: (Joint.THUMB_CMC,),
    Channel.THUMB_FLEXOR: (Joint.THUMB_MCP, Joint.THUMB_IP),
}
"""Joints that a channel moves."""
JAMMED_NM = 50.0
"""Friction that no servo overcomes, N m."""


def with_values(unit: Unit, field: str, where: Sequence[int], change: Callable[[float], float]) -> Unit:
    """Return a unit with some values of a field of its mechanics changed."""
    values: list[float] = list(getattr(unit.hand, field))
    for index in where:
        values[index] = change(values[index])
    changed: dict[str, Any] = {field: tuple(values)}
    return replace(unit, hand=replace(unit.hand, **changed))


def on_channel(field: str, change: Callable[[float, float], float]) -> UnitChange:
    """Change a value of the fault's channel; `change` makes the new one of the old one and the severity."""
    return lambda unit, fault: with_values(unit, field, [fault.where], lambda value: change(value, fault.severity))


def on_joints(field: str, change: Callable[[float, float], float]) -> UnitChange:
    """Change a value of the joints that the fault's channel moves."""
    return lambda unit, fault: with_values(
        unit, field, JOINTS[fault.where], lambda value: change(value, fault.severity)
    )


def another_unit(change: UnitChange) -> Inject:
    """Return what injects a fault that is another unit."""
    return lambda assembly, fault: assembly.changed(lambda unit: change(unit, fault))
