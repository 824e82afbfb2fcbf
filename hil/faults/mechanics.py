"""Faults of mechanics: a hand that is built differently behind its shafts, or whose servos are of other make.

Each is a function from a unit to a unit. One that begins later replaces the mechanics of the running plant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from aero.channels import Channel, Joint
from firmware_emulator.servo.parameters import RAD_PER_COUNT
from hil.faults.assembly import Injector
from hil.faults.fault import ALL, CABLES, FINGERS, HOMED, ONCE, RUBBING, SHARE, SWITCH, Fault, Kind
from model.units import Unit

Change = Callable[[Unit, Fault], Unit]

JOINTS: dict[Channel, tuple[Joint, ...]] = {
    **{finger: (Joint(3 * finger), Joint(3 * finger + 1), Joint(3 * finger + 2)) for finger in FINGERS},
    Channel.THUMB_ABDUCTION: (Joint.THUMB_ABDUCTION,),
    Channel.THUMB_CMC_FLEXION: (Joint.THUMB_CMC,),
    Channel.THUMB_FLEXOR: (Joint.THUMB_MCP, Joint.THUMB_IP),
}
"""Joints that a channel moves."""
MIDDLE_JOINT = {channel: joints[len(joints) // 2] for channel, joints in JOINTS.items()} | {
    Channel.THUMB_FLEXOR: Joint.THUMB_MCP
}
"""The joint of a channel that is stiff: the PIP of a finger."""
JAMMED_NM = 50.0
"""Friction that no servo overcomes, N m."""
THUMB_CABLES = (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
NEVER_TAUT_M = 0.9
"""Take-up of a cable that is off: 100 rad of spool."""


def _with(unit: Unit, field: str, where: Sequence[int], change: Callable[[float], float]) -> Unit:
    """Return a unit with some values of a field of its mechanics changed."""
    values: list[float] = list(getattr(unit.hand, field))
    for index in where:
        values[index] = change(values[index])
    changed: dict[str, Any] = {field: tuple(values)}
    return replace(unit, hand=replace(unit.hand, **changed))


def _on_channel(field: str, change: Callable[[float, float], float]) -> Change:
    """Change a value of the fault's channel; `change` makes the new one of the old one and the severity."""

    def changed(unit: Unit, fault: Fault) -> Unit:
        return _with(unit, field, [_channel(fault)], lambda value: change(value, fault.severity))

    return changed


def _on_joints(field: str, change: Callable[[float, float], float]) -> Change:
    """Change a value of the joints that the fault's channel moves."""

    def changed(unit: Unit, fault: Fault) -> Unit:
        return _with(unit, field, JOINTS[_channel(fault)], lambda value: change(value, fault.severity))

    return changed


def _channel(fault: Fault) -> Channel:
    assert fault.channel is not None
    return fault.channel


def _both_springs(change: Callable[[float, float], float]) -> Change:
    opened, closed = _on_joints("spring_open", change), _on_joints("spring_closed", change)

    def changed(unit: Unit, fault: Fault) -> Unit:
        # A spring that pulls less closed than open is refused, also on the way.
        stronger = change(1.0, fault.severity) > 1.0
        return opened(closed(unit, fault), fault) if stronger else closed(opened(unit, fault), fault)

    return changed


def _stiff_joint(unit: Unit, fault: Fault) -> Unit:
    return _with(unit, "joint_friction", [MIDDLE_JOINT[_channel(fault)]], lambda value: value + fault.severity)


def _jammed(unit: Unit, fault: Fault) -> Unit:
    return _with(unit, "joint_friction", JOINTS[_channel(fault)], lambda value: JAMMED_NM)


def _slow(unit: Unit, fault: Fault) -> Unit:
    # Free speed is where back-EMF and drag take all of the stall torque.
    speed = unit.servos.no_load_speed_counts * RAD_PER_COUNT
    drag = unit.servos.stall_torque / speed * (1.0 / (1.0 - fault.severity) - 1.0)
    return _with(unit, "spool_damping", [_channel(fault)], lambda value: value + drag)


def _cable_soft(unit: Unit, fault: Fault) -> Unit:
    return replace(unit, hand=replace(unit.hand, cable_compliance=unit.hand.cable_compliance + fault.severity * 1e-6))


def _supply_low(unit: Unit, fault: Fault) -> Unit:
    return replace(unit, hand=replace(unit.hand, supply_ratio=unit.hand.supply_ratio * (1.0 - fault.severity)))


def _derailed(unit: Unit, fault: Fault) -> Unit:
    which = 0 if fault.channel is Channel.THUMB_CMC_FLEXION else 1
    return _with(unit, "abduction_winding", [which], lambda value: value + fault.severity * 1e-3)


def _late_goals(unit: Unit, fault: Fault) -> Unit:
    delay = unit.servos.goal_delay_s + fault.severity / 1000.0
    return replace(unit, servos=replace(unit.servos, goal_delay_s=delay))


def _slow_turnaround(unit: Unit, fault: Fault) -> Unit:
    return replace(unit, servos=replace(unit.servos, turnaround_s=unit.servos.turnaround_s + fault.severity * 1e-6))


KINDS = (
    Kind("gear_friction", "servo", ("D20",), "N m", (0.03, 0.08, 0.2), "gears or a spool rub", ALL),
    Kind("gear_jammed", "servo", ("D1",), "", SWITCH, "the gears are stuck", ALL, cause="stuck", bounds=ONCE),
    Kind(
        "slow_servo", "servo", ("D4",), "of free speed lost", (0.1, 0.3, 0.6), "a servo is slow", ALL, bounds=(0, 0.95)
    ),
    Kind("late_goals", "servo", ("D5",), "ms", (10, 30, 100), "servos act late on their goals", later=False),
    Kind("slow_turnaround", "bus", ("C6", "C7"), "µs", (300, 900, 3000), "servos answer late on the bus", later=False),
    Kind("supply_low", "hand", ("D13",), "of voltage lost", (0.08, 0.2, 0.4), "the supply is weak", bounds=(0, 0.95)),
    Kind(
        "cable_friction",
        "hand",
        ("D20",),
        "of tension",
        (0.15, 0.4, 0.8),
        "a cable rubs in its sheath",
        CABLES,
        reason=RUBBING,
    ),
    Kind("cable_long", "hand", ("D14",), "mm", (3, 7.6, 20), "a cable is slack at the open hand", CABLES, reason=HOMED),
    Kind(
        "cable_short",
        "hand",
        ("D14",),
        "mm",
        (3, 7, 12),
        "a cable is too short and holds the digit bent",
        CABLES,
        reason=HOMED,
    ),
    Kind("cable_soft", "hand", ("D14",), "µm/N", (15, 60, 200), "the cables stretch"),
    Kind("cable_snapped", "hand", ("D15", "B12"), "", SWITCH, "a cable is torn or off its spool", CABLES, bounds=ONCE),
    Kind(
        "spool_wrong",
        "hand",
        ("D7",),
        "factor",
        (1.04, 1.1, 1.3),
        "a spool is small for its cable",
        CABLES,
        reason="the encoder turns with the motor, whatever the spool winds; look whether the open finger is straight",
        bounds=(0.5, 2),
    ),
    Kind(
        "thumb_derailed", "hand", ("D16",), "mm/rad", (1.5, 4, 8), "a thumb cable runs beside its guide", THUMB_CABLES
    ),
    Kind(
        "spring_off",
        "hand",
        ("D11",),
        "of torque lost",
        (0.3, 0.6, 1.0),
        "return springs are off",
        CABLES,
        bounds=SHARE,
    ),
    Kind("spring_strong", "hand", ("D11",), "of torque added", (0.3, 0.8, 2.0), "return springs pull too much", CABLES),
    Kind(
        "stiff_joint",
        "hand",
        ("D20",),
        "N m",
        (0.03, 0.06, 0.15),
        "a joint rubs (of a finger, the PIP)",
        ALL,
        reason=RUBBING,
    ),
    Kind("digit_jammed", "hand", ("D18",), "", SWITCH, "a digit is held by something", ALL, bounds=ONCE),
    Kind(
        "stop_gone",
        "hand",
        ("D19",),
        "deg",
        (3, 10, 40),
        "closed stops let the joints go on",
        ALL,
        reason="homing puts the zero where the stop is, so the finger closes as far by its encoder and opens less",
        bounds=(0, 90),
    ),
    Kind(
        "stop_early", "hand", ("D19",), "of travel lost", (0.03, 0.1, 0.4), "joints stop early", ALL, bounds=(0, 0.95)
    ),
)
CHANGES: dict[str, Change] = {
    "gear_friction": _on_channel("spool_friction", lambda value, severity: value + severity),
    "gear_jammed": _on_channel("spool_friction", lambda value, severity: JAMMED_NM),
    "slow_servo": _slow,
    "late_goals": _late_goals,
    "slow_turnaround": _slow_turnaround,
    "supply_low": _supply_low,
    "cable_friction": _on_channel("cable_friction", lambda value, severity: value + severity),
    "cable_long": _on_channel("cable_take_up", lambda value, severity: value + severity * 1e-3),
    "cable_short": _on_channel("cable_take_up", lambda value, severity: value - severity * 1e-3),
    "cable_soft": _cable_soft,
    "cable_snapped": _on_channel("cable_take_up", lambda value, severity: NEVER_TAUT_M),
    "spool_wrong": _on_channel("winding_scale", lambda value, severity: value * severity),
    "thumb_derailed": _derailed,
    "spring_off": _both_springs(lambda value, severity: value * (1.0 - severity)),
    "spring_strong": _both_springs(lambda value, severity: value * (1.0 + severity)),
    "stiff_joint": _stiff_joint,
    "digit_jammed": _jammed,
    "stop_gone": _on_joints("closed_stop", lambda value, severity: value + math.radians(severity)),
    "stop_early": _on_joints("closed_stop", lambda value, severity: value * (1.0 - severity)),
}


def _rebuilt(change: Change) -> Injector:
    return lambda assembly, fault: lambda: assembly.rebuild(lambda unit: change(unit, fault))


INJECTORS = {name: _rebuilt(change) for name, change in CHANGES.items()}
