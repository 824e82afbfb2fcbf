"""Mechanical faults of cables, spools, joints, springs, stops and gears, as changes of unit parameters."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from aero.channels import CABLES, FINGERS, Channel, Joint
from firmware_emulator.servo.parameters import RAD_PER_COUNT
from hil.emulated.faults.assembly import Active, HandAssembly
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Inject, Injection, Severity, share
from hil.verdict.part import Part
from model.units import Unit

UnitChange = Callable[[Unit, Injection], Unit]
CABLE, JOINT, GEAR = FaultLayer.CABLE, FaultLayer.JOINT, FaultLayer.GEAR
JOINTS: dict[Channel, tuple[Joint, ...]] = {
    **{finger: (Joint(3 * finger), Joint(3 * finger + 1), Joint(3 * finger + 2)) for finger in FINGERS},
    Channel.THUMB_ABDUCTION: (Joint.THUMB_ABDUCTION,),
    Channel.THUMB_CMC_FLEXION: (Joint.THUMB_CMC,),
    Channel.THUMB_FLEXOR: (Joint.THUMB_MCP, Joint.THUMB_IP),
}
MIDDLE_JOINT = {channel: joints[len(joints) // 2] for channel, joints in JOINTS.items()} | {
    Channel.THUMB_FLEXOR: Joint.THUMB_MCP
}
"""Joint that `stiff_joint` acts on, by channel: the PIP of a finger."""
THUMB_CABLES = (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
JAMMED_NM = 50.0
"""Friction beyond the torque of any servo, N m."""
NEVER_TAUT_M = 90.0
"""Take-up of a detached cable, m: 10,000 rad of spool; one homing without load winds 24 rad."""


def with_values(unit: Unit, field: str, where: Sequence[int], change: Callable[[float], float]) -> Unit:
    """Return a unit with the values at the indices `where` of a mechanics field changed."""
    values: list[float] = list(getattr(unit.hand, field))
    for index in where:
        values[index] = change(values[index])
    changed: dict[str, Any] = {field: tuple(values)}
    return replace(unit, hand=replace(unit.hand, **changed))


def unloaded(unit: Unit, channel: Channel) -> Unit:
    """Return a unit with the servo of `channel` unloaded."""
    if channel in CABLES:
        return with_values(unit, "cable_take_up", [channel], lambda _: NEVER_TAUT_M)
    # Abduction has no cable: its shaft is the joint, so the joint's own torques and stop are removed instead.
    nothing: dict[str, Callable[[float], float]] = {
        "joint_friction": lambda _: 0.0,
        "spring_open": lambda _: 0.0,
        "spring_closed": lambda _: 0.0,
        "closed_stop": lambda stop: stop + math.pi,
    }
    for field, value in nothing.items():
        unit = with_values(unit, field, JOINTS[channel], value)
    return unit


def another_unit(change: UnitChange) -> Inject:
    """Return an injector of a change of unit parameters."""
    return lambda assembly, fault: assembly.changed(lambda unit: change(unit, fault))


def _on_channel(field: str, change: Callable[[float, float], float]) -> Inject:
    """Change a field at the fault's channel; `change` maps the old value and the severity to the new value."""
    return another_unit(
        lambda unit, fault: with_values(unit, field, [fault.where], lambda value: change(value, fault.severity))
    )


def _on_joints(change: Callable[[float, float], float], *fields: str) -> Inject:

    def changed(unit: Unit, fault: Injection) -> Unit:
        # Each intermediate unit is validated and must not have a closed spring weaker than the open one, so an
        # increase starts with the first field, spring_closed.
        ordered = fields if change(1.0, fault.severity) > 1.0 else fields[::-1]
        for field in ordered:
            unit = with_values(unit, field, JOINTS[fault.where], lambda value: change(value, fault.severity))
        return unit

    return another_unit(changed)


def _soft(unit: Unit, fault: Injection) -> Unit:
    return replace(unit, hand=replace(unit.hand, cable_compliance=unit.hand.cable_compliance + fault.severity * 1e-6))


def _derailed(unit: Unit, fault: Injection) -> Unit:
    which = THUMB_CABLES.index(fault.where)
    return with_values(unit, "abduction_winding", [which], lambda value: value + fault.severity * 1e-3)


def _stiff(unit: Unit, fault: Injection) -> Unit:
    return with_values(unit, "joint_friction", [MIDDLE_JOINT[fault.where]], lambda value: value + fault.severity)


def _slow(unit: Unit, fault: Injection) -> Unit:
    # At free speed, back-EMF and drag together equal the stall torque.
    speed = unit.servos.no_load_speed_counts * RAD_PER_COUNT
    drag = unit.servos.stall_torque / speed * (1.0 / (1.0 - fault.severity) - 1.0)
    return with_values(unit, "spool_damping", [fault.where], lambda value: value + drag)


def _all_servos(field: str, per_unit: float) -> Inject:
    """Return an injector that lengthens a delay of all servos by the severity times `per_unit`, s."""

    def inject(assembly: HandAssembly, fault: Injection) -> Active:
        def longer(unit: Unit) -> Unit:
            changed: dict[str, Any] = {field: getattr(unit.servos, field) + fault.severity * per_unit}
            return replace(unit, servos=replace(unit.servos, **changed))

        active = assembly.changed(longer)

        def retimed(act: Callable[[], object]) -> None:
            act()
            if assembly.is_running:
                assembly.electronics.chain.retime(assembly.unit.servos)

        return Active(lambda: retimed(active.begin), lambda: retimed(active.undo))

    return inject


# fmt: off
FAULTS = (
    Fault("cable_friction", CABLE, Part.DIGIT, "cable friction in the sheath",
          _on_channel("cable_friction", lambda value, severity: value + severity),
          CABLES, Severity("of tension", (0.15, 0.4, 0.8), 0, 10)),
    Fault("cable_long", CABLE, Part.DIGIT, "a cable is slack at the open hand",
          _on_channel("cable_take_up", lambda value, severity: value + severity * 1e-3),
          CABLES, Severity("mm", (3, 7.6, 20), 0, 100)),
    Fault("cable_short", CABLE, Part.DIGIT, "cable too short: the digit stays bent",
          _on_channel("cable_take_up", lambda value, severity: value - severity * 1e-3),
          CABLES, Severity("mm", (3, 7, 12), 0, 50)),
    # Part SETUP, because all cables share one material and no single digit can be repaired.
    Fault("cable_soft", CABLE, Part.SETUP, "the cables stretch",
          another_unit(_soft), severity=Severity("µm/N", (15, 60, 200), 0, 10_000)),
    Fault("cable_snapped", CABLE, Part.DIGIT, "a cable is torn or off its spool",
          _on_channel("cable_take_up", lambda value, severity: NEVER_TAUT_M), CABLES),
    Fault("spool_wrong", CABLE, Part.DIGIT, "spool radius too small",
          _on_channel("winding_scale", lambda value, severity: value * severity),
          CABLES, Severity("factor", (1.04, 1.1, 1.3), 0.5, 2)),
    Fault("thumb_derailed", CABLE, Part.DIGIT, "derailed thumb cable",
          another_unit(_derailed), THUMB_CABLES, Severity("mm/rad", (1.5, 4, 8), 0, 30)),
    Fault("spring_off", JOINT, Part.DIGIT, "return springs weak or missing",
          _on_joints(lambda value, severity: value * (1.0 - severity), "spring_closed", "spring_open"),
          CABLES, share("torque lost", 0.3, 0.6, 1.0)),
    Fault("spring_strong", JOINT, Part.DIGIT, "return springs too strong",
          _on_joints(lambda value, severity: value * (1.0 + severity), "spring_closed", "spring_open"),
          CABLES, Severity("of torque added", (0.3, 0.8, 2.0), 0, 20)),
    Fault("stiff_joint", JOINT, Part.DIGIT, "stiff joint (of a finger: the PIP)",
          another_unit(_stiff), ALL, Severity("N m", (0.03, 0.06, 0.15), 0, JAMMED_NM)),
    Fault("digit_jammed", JOINT, Part.DIGIT, "jammed digit",
          _on_joints(lambda value, severity: JAMMED_NM, "joint_friction"), ALL),
    Fault("stop_gone", JOINT, Part.DIGIT, "closed end stop missing",
          _on_joints(lambda value, severity: value + math.radians(severity), "closed_stop"),
          ALL, Severity("deg", (3, 10, 40), 0, 90)),
    Fault("stop_early", JOINT, Part.DIGIT, "reduced joint travel",
          _on_joints(lambda value, severity: value * (1.0 - severity), "closed_stop"),
          ALL, Severity("of travel lost", (0.03, 0.1, 0.4), 0, 0.95)),
    Fault("gear_friction", GEAR, Part.SERVO, "friction of gears or spool",
          _on_channel("spool_friction", lambda value, severity: value + severity),
          ALL, Severity("N m", (0.03, 0.08, 0.2), 0, JAMMED_NM)),
    Fault("gear_jammed", GEAR, Part.SERVO, "jammed gears",
          _on_channel("spool_friction", lambda value, severity: JAMMED_NM), ALL),
    Fault("slow_servo", GEAR, Part.SERVO, "a servo is slow",
          another_unit(_slow), ALL, Severity("of free speed lost", (0.1, 0.3, 0.6), 0, 0.95)),
    # Part BOARD, because a delay common to all servos points to the settings that the board stores in them.
    Fault("late_goals", GEAR, Part.BOARD, "delayed goal positions",
          _all_servos("goal_delay_s", 1e-3), severity=Severity("ms", (10, 30, 100), 0, 10_000)),
    Fault("slow_turnaround", GEAR, Part.BOARD, "slow bus turnaround",
          _all_servos("turnaround_s", 1e-6), severity=Severity("µs", (300, 900, 3000), 0, 100_000), alike=(Part.BUS,)),
)
# fmt: on
