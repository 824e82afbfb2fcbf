"""Faults of a motor: between what a servo asks of it and what the shaft gets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from aero.channels import Channel
from firmware_emulator.plant import Drive, Plant
from hil.faults.assembly import HandAssembly, Injector
from hil.faults.fault import ALL, FINGERS, ONCE, SHARE, SWITCH, Fault, Kind
from hil.faults.shaft_fault import Floats, ShaftFault
from model.units import Unit

PERIOD_S = 0.1
"""Period of a motor that works now and then, s."""
UNPOWERED = Drive(powered=False)
NEIGHBOUR = {
    Channel.INDEX: Channel.MIDDLE,
    Channel.MIDDLE: Channel.RING,
    Channel.RING: Channel.PINKY,
    Channel.THUMB_CMC_FLEXION: Channel.THUMB_FLEXOR,
}
"""With which channel another one is mixed up."""
FINGERS_ALIKE = "the fingers are alike, so every reading is that of a good hand; look which finger moves"


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


class Weak(ShaftFault):
    """A motor that gives less torque for its current, as with magnets that were hot."""

    def __init__(self, behind: Plant, shaft: int, lost: float) -> None:
        super().__init__(behind, shaft)
        self._lost = lost

    def changed(self, drive: Drive) -> Drive:
        """Return the drive with less torque."""
        return weaker(drive, self._lost)

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


class Reversed(ShaftFault):
    """A cable that is wound the other way round, or a motor with its poles exchanged."""

    def changed(self, drive: Drive) -> Drive:
        """Return the drive in the other direction."""
        return replace(drive, setpoint=-drive.setpoint, torque=-drive.torque)

    def angles(self) -> Floats:
        """Return shaft angles, one with the other sign."""
        return self._turned(self.behind.angles())

    def speeds(self) -> Floats:
        """Return shaft speeds, one with the other sign."""
        return self._turned(self.behind.speeds())

    def efforts(self) -> Floats:
        """Return efforts, one with the other sign."""
        return self._turned(self.behind.efforts())

    def _turned(self, values: Floats) -> Floats:
        if self.active:
            values[self.shaft] *= -1.0
        return values


class Exchanged(ShaftFault):
    """Two servos that pull each other's cables."""

    def __init__(self, behind: Plant, shaft: int) -> None:
        super().__init__(behind, shaft)
        self._order = list(range(7))
        other = NEIGHBOUR[Channel(shaft)]
        self._order[shaft], self._order[other] = other, shaft

    def drive(self, shaft: int, drive: Drive) -> None:
        """Replace the drive of a shaft."""
        self.behind.drive(self._order[shaft], drive)

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change the goal angle of a shaft, rad."""
        self.behind.set_setpoint(self._order[shaft], setpoint)

    def angles(self) -> Floats:
        """Return shaft angles, (7,), rad."""
        return self.behind.angles()[self._order]

    def speeds(self) -> Floats:
        """Return shaft speeds, (7,), rad/s."""
        return self.behind.speeds()[self._order]

    def efforts(self) -> Floats:
        """Return efforts, (7,), N m."""
        return self.behind.efforts()[self._order]

    def renew(self) -> None:
        """Do nothing: it is there from the beginning."""


def on_shaft(make: Callable[[HandAssembly, Fault], ShaftFault]) -> Injector:
    """Return the injector of a fault in front of `assembly.shafts`."""
    return lambda assembly, fault: assembly.insert(make(assembly, fault))


def _motor(change: Callable[[Drive, float, Unit], Drive]) -> Injector:
    return on_shaft(
        lambda assembly, fault: Motor(
            assembly.shafts, shaft_of(fault), lambda drive: change(drive, fault.severity, assembly.healthy)
        )
    )


def shaft_of(fault: Fault) -> int:
    """Return the index of the fault's shaft."""
    assert fault.channel is not None
    return int(fault.channel)


def _runaway(drive: Drive, share: float, unit: Unit) -> Drive:
    torque = share * unit.servos.stall_torque
    return Drive(torque=torque, limit=torque)


KINDS = (
    Kind(
        "motor_dead", "servo", ("D2", "B12"), "", SWITCH, "a motor gets no current", ALL, bounds=ONCE, excludes="motor"
    ),
    Kind(
        "motor_weak",
        "servo",
        ("D3",),
        "of torque lost",
        (0.15, 0.4, 0.8),
        "a motor gives little torque for its current",
        ALL,
        bounds=(0, 0.99),
    ),
    Kind(
        "motor_intermittent",
        "servo",
        ("D6",),
        "of time off",
        (0.1, 0.3, 0.7),
        "a motor has a bad contact",
        ALL,
        bounds=SHARE,
    ),
    Kind(
        "motor_runaway",
        "servo",
        ("D8",),
        "of stall torque",
        (0.2, 0.4, 1.0),
        "a motor only closes",
        ALL,
        cause="stuck",
        excludes="motor",
        bounds=SHARE,
    ),
    Kind(
        "winding_reversed",
        "hand",
        ("D17",),
        "",
        SWITCH,
        "a cable is wound the other way round",
        ALL,
        bounds=ONCE,
        later=False,
    ),
    Kind(
        "finger_cables_swapped",
        "hand",
        ("D21",),
        "",
        SWITCH,
        "two fingers' cables are exchanged",
        FINGERS[:3],
        cause="fingers_exchanged",
        bounds=ONCE,
        later=False,
        visible=False,
        reason=FINGERS_ALIKE,
    ),
    Kind(
        "thumb_cables_swapped",
        "hand",
        ("D21",),
        "",
        SWITCH,
        "the two thumb cables are exchanged",
        (Channel.THUMB_CMC_FLEXION,),
        bounds=ONCE,
        later=False,
    ),
)
INJECTORS: dict[str, Injector] = {
    "motor_dead": _motor(lambda drive, severity, unit: UNPOWERED),
    "motor_weak": on_shaft(lambda assembly, fault: Weak(assembly.shafts, shaft_of(fault), fault.severity)),
    "motor_runaway": _motor(_runaway),
    "motor_intermittent": on_shaft(
        lambda assembly, fault: Intermittent(assembly.shafts, shaft_of(fault), fault.severity)
    ),
    "winding_reversed": on_shaft(lambda assembly, fault: Reversed(assembly.shafts, shaft_of(fault))),
    "finger_cables_swapped": on_shaft(lambda assembly, fault: Exchanged(assembly.shafts, shaft_of(fault))),
    "thumb_cables_swapped": on_shaft(lambda assembly, fault: Exchanged(assembly.shafts, shaft_of(fault))),
}
