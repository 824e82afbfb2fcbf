"""Faults of gears, and servos of another make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from firmware_emulator.servo.parameters import RAD_PER_COUNT
from hil.faults.active import Active
from hil.faults.assembly import HandAssembly
from hil.faults.fault import ALL, Fault, FaultLayer, Inject, Injection, Severity
from hil.faults.part import Part
from hil.faults.unit_change import JAMMED_NM, another_unit, on_channel, with_values
from model.units import Unit


def _slow(unit: Unit, fault: Injection) -> Unit:
    # Free speed is where back-EMF and drag take all of the stall torque.
    speed = unit.servos.no_load_speed_counts * RAD_PER_COUNT
    drag = unit.servos.stall_torque / speed * (1.0 / (1.0 - fault.severity) - 1.0)
    return with_values(unit, "spool_damping", [fault.where], lambda value: value + drag)


def _all_servos(field: str, per_unit: float) -> Inject:
    """Return what adds to a time of all servos, s, the severity being in units of `per_unit` s."""

    def inject(assembly: HandAssembly, fault: Injection) -> Active:
        def longer(unit: Unit) -> Unit:
            changed: dict[str, Any] = {field: getattr(unit.servos, field) + fault.severity * per_unit}
            return replace(unit, servos=replace(unit.servos, **changed))

        active = assembly.changed(longer)

        def retimed(act: Callable[[], object]) -> None:
            act()
            if assembly.is_running:
                assembly.hand.chain.retime(assembly.unit.servos)

        clear = active.clear
        assert clear is not None, "another unit can be undone"
        return Active(lambda: retimed(active.begin), lambda: retimed(clear))

    return inject


FAULTS = (
    Fault(
        "gear_friction",
        FaultLayer.GEAR,
        Part.SERVO,
        "gears or a spool rub",
        another_unit(on_channel("spool_friction", lambda value, severity: value + severity)),
        ALL,
        Severity("N m", (0.03, 0.08, 0.2)),
    ),
    Fault(
        "gear_jammed",
        FaultLayer.GEAR,
        Part.SERVO,
        "the gears are stuck",
        another_unit(on_channel("spool_friction", lambda value, severity: JAMMED_NM)),
        ALL,
    ),
    Fault(
        "slow_servo",
        FaultLayer.GEAR,
        Part.SERVO,
        "a servo is slow",
        another_unit(_slow),
        ALL,
        Severity("of free speed lost", (0.1, 0.3, 0.6), 0, 0.95),
    ),
    # What all servos share is what the board has stored in them, or does with them.
    Fault(
        "late_goals",
        FaultLayer.GEAR,
        Part.BOARD,
        "servos act late on their goals",
        _all_servos("goal_delay_s", 1e-3),
        severity=Severity("ms", (10, 30, 100)),
    ),
    Fault(
        "slow_turnaround",
        FaultLayer.GEAR,
        Part.BOARD,
        "servos answer late on the bus",
        _all_servos("turnaround_s", 1e-6),
        severity=Severity("µs", (300, 900, 3000)),
        alike=(Part.BUS,),
    ),
)
