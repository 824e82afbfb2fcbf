"""Motor faults: between the drive that a servo requests and the drive of the shaft."""

from collections.abc import Callable
from dataclasses import replace

from aero.floats import Floats
from firmware_emulator.plant import Drive, Plant
from hil.emulated.faults.assembly import HandAssembly
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Inject, Injection, Severity, share
from hil.emulated.faults.shaft_fault import ShaftFault
from hil.verdict.part import Part
from model.units import Unit

MOTOR = FaultLayer.MOTOR
PERIOD_S = 0.1
UNPOWERED = Drive(powered=False)


def weaker(drive: Drive, lost: float) -> Drive:
    """Return a drive with all torques reduced by the fraction `lost`."""
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
    """Motor whose drive differs from the requested one."""

    def __init__(self, behind: Plant, shaft: int, change: Callable[[Drive], Drive]) -> None:
        super().__init__(behind, shaft)
        self._change = change

    def changed(self, drive: Drive) -> Drive:
        """Return the drive after the motor fault."""
        return self._change(drive)


class Weak(Motor):
    """Motor with a reduced torque constant, as after overheated magnets."""

    def __init__(self, behind: Plant, shaft: int, lost: float) -> None:
        super().__init__(behind, shaft, lambda drive: weaker(drive, lost))
        self._lost = lost

    def efforts(self) -> Floats:
        """Return efforts, (7,), N m, the weak motor's as a healthy motor has at that current."""
        efforts = self.behind.efforts()
        if self.active:
            efforts[self.shaft] /= 1.0 - self._lost
        return efforts


class Intermittent(ShaftFault):
    """Motor without power for a fraction of every period."""

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
        """Return an unpowered drive during the off time."""
        return UNPOWERED if self._off else drive


def on_shaft(make: Callable[[HandAssembly, Injection], ShaftFault]) -> Inject:
    """Return an injector of a fault in front of `assembly.shafts`."""
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
    Fault("motor_weak", MOTOR, Part.SERVO, "reduced torque constant",
          on_shaft(lambda assembly, fault: Weak(assembly.shafts, fault.where, fault.severity)),
          ALL, Severity("of torque lost", (0.15, 0.4, 0.8), 0.0, 0.99)),
    Fault("motor_intermittent", MOTOR, Part.SERVO, "a motor has a bad contact",
          on_shaft(lambda assembly, fault: Intermittent(assembly.shafts, fault.where, fault.severity)),
          ALL, share("time off", 0.1, 0.3, 0.7)),
    Fault("motor_runaway", MOTOR, Part.SERVO, "runaway motor, always closing",
          _motor(_runaway), ALL, share("stall torque", 0.2, 0.4, 1.0), excludes="motor"),
)
# fmt: on
