"""Faults of joints: their springs, their stops, their bearings, and what holds them."""

from __future__ import annotations

import math
from collections.abc import Callable

from aero.channels import CABLES, Channel, Joint
from hil.faults.fault import ALL, Fault, FaultLayer, Injection, Severity, share
from hil.faults.part import Part
from hil.faults.unit_change import JAMMED_NM, JOINTS, UnitChange, another_unit, on_joints, with_values
from model.units import Unit

MIDDLE_JOINT = {channel: joints[len(joints) // 2] for channel, joints in JOINTS.items()} | {
    Channel.THUMB_FLEXOR: Joint.THUMB_MCP
}
"""The joint of a channel that is stiff: the PIP of a finger."""


def _both_springs(change: Callable[[float, float], float]) -> UnitChange:
    opened, closed = on_joints("spring_open", change), on_joints("spring_closed", change)

    def changed(unit: Unit, fault: Injection) -> Unit:
        # A spring that pulls less closed than open is refused, also on the way.
        stronger = change(1.0, fault.severity) > 1.0
        return opened(closed(unit, fault), fault) if stronger else closed(opened(unit, fault), fault)

    return changed


def _stiff(unit: Unit, fault: Injection) -> Unit:
    return with_values(unit, "joint_friction", [MIDDLE_JOINT[fault.where]], lambda value: value + fault.severity)


def _fault(
    name: str, words: str, change: UnitChange, severity: Severity | None, channels: tuple[Channel, ...] = ALL
) -> Fault:
    return Fault(name, FaultLayer.JOINT, Part.DIGIT, words, another_unit(change), channels, severity)


FAULTS = (
    _fault(
        "spring_off",
        "return springs are off",
        _both_springs(lambda value, severity: value * (1.0 - severity)),
        share("torque lost", 0.3, 0.6, 1.0),
        CABLES,
    ),
    _fault(
        "spring_strong",
        "return springs pull too much",
        _both_springs(lambda value, severity: value * (1.0 + severity)),
        Severity("of torque added", (0.3, 0.8, 2.0)),
        CABLES,
    ),
    _fault("stiff_joint", "a joint rubs (of a finger, the PIP)", _stiff, Severity("N m", (0.03, 0.06, 0.15))),
    _fault(
        "digit_jammed",
        "a digit is held by something",
        on_joints("joint_friction", lambda value, severity: JAMMED_NM),
        None,
    ),
    _fault(
        "stop_gone",
        "closed stops let the joints go on",
        on_joints("closed_stop", lambda value, severity: value + math.radians(severity)),
        Severity("deg", (3, 10, 40), 0, 90),
    ),
    _fault(
        "stop_early",
        "joints stop early",
        on_joints("closed_stop", lambda value, severity: value * (1.0 - severity)),
        Severity("of travel lost", (0.03, 0.1, 0.4), 0, 0.95),
    ),
)
