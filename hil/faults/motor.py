"""Faults of a motor: between what a servo asks of it and what the shaft gets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from firmware_emulator.plant import Drive, Plant
from hil.faults.assembly import HandAssembly
from hil.faults.fault import ALL, Fault, FaultLayer, Inject, Injection, Part, Severity, share
from hil.faults.shaft_fault import Floats, ShaftFault
from model.units import Unit

MOTOR = FaultLayer.MOTOR
PERIOD_S = 0.1
"""Period of a motor that works now and then, s."""
UNPOWERED = Drive(powered=False)


def weaker(drive: Drive, lost: float) -> Drive:
    """Return a drive with all torques less by the share `lost`."""
    left = 1.0 - lost
    return replace(
        drive,
        stiffness=left * drive.stiffness,
        damping=left * drive.damping,
        torque=left * drive.torque,
        limit=left * drive.limit,
        current_limit=left * drive.current_limit,
    )


class Motor(ShaftFault):
    """A motor that makes something else of what it is asked for."""

    def __init__(self, behind: Plant, shaft: int, change: Callable[[Drive], Drive]) -> None:
        super().__init__(behind, shaft)
        self._change = change

    def changed(self, drive: Drive) -> Drive:
        """Return what the motor makes of it."""
        return self._change(drive)


class Weak(Motor):
    """A motor that gives less torque for its current, as with magnets that were hot."""

    def __init__(self, behind: Plant, shaft: int, lost: float) -> None:
        super().__init__(behind, shaft, lambda drive: weaker(drive, lost))
        self._lost = lost

    def efforts(self) -> Floats:
        """Return efforts, (7,), N m, that of the weak motor as its current tells it."""
        efforts = self.behind.efforts()
        if self.active:
            efforts[self.shaft] /= 1.0 - self._lost
        return efforts


class Intermittent(ShaftFault):
    """A motor without power for a share of every period."""

    def __init__(self, behind: Plant, shaft: int, share: float) -> None:
        super().__init__(behind, shaft)
        self._share = share
        self._off = False

    def advance_to(self, t: float) -> None:
        """Integrate to `t`, s, and switch the motor."""
        super().advance_to(t)
        off = self.time % PERIOD_S < self._share * PERIOD_S
        if self.active and off != self._off:
            self._off = off
            self.renew()

    def changed(self, drive: Drive) -> Drive:
        """Return nothing while it is off."""
        return UNPOWERED if self._off else drive


def on_shaft(make: Callable[[HandAssembly, Injection], ShaftFault]) -> Inject:
    """Return what injects a fault in front of `assembly.shafts`."""
    return lambda assembly, fault: assembly.insert(make(assembly, fault))


def _motor(change: Callable[[Drive, float, Unit], Drive]) -> Inject:
    return on_shaft(
        lambda assembly, fault: Motor(
            assembly.shafts, fault.where, lambda drive: change(drive, fault.severity, assembly.healthy)
        )
    )


def _runaway(drive: Drive, share: float, unit: Unit) -> Drive:
    torque = share * unit.servos.stall_torque
    return Drive(torque=torque, limit=torque)


# fmt: off
FAULTS = (
    Fault("motor_dead", MOTOR, Part.SERVO, "a motor gets no current",
          _motor(lambda drive, severity, unit: UNPOWERED), ALL, excludes="motor"),
    Fault("motor_weak", MOTOR, Part.SERVO, "a motor gives little torque for its current",
          on_shaft(lambda assembly, fault: Weak(assembly.shafts, fault.where, fault.severity)),
          ALL, Severity("of torque lost", (0.15, 0.4, 0.8), 0.0, 0.99)),
    Fault("motor_intermittent", MOTOR, Part.SERVO, "a motor has a bad contact",
          on_shaft(lambda assembly, fault: Intermittent(assembly.shafts, fault.where, fault.severity)),
          ALL, share("time off", 0.1, 0.3, 0.7)),
    Fault("motor_runaway", MOTOR, Part.SERVO, "a motor only closes",
          _motor(_runaway), ALL, share("stall torque", 0.2, 0.4, 1.0), excludes="motor"),
)
# fmt: on
