"""Winding faults of the cables: between healthy servos and the mechanics."""

from dataclasses import replace

from aero.channels import FINGERS, Channel
from aero.floats import Floats
from firmware_emulator.plant import Drive, Plant
from hil.emulated.faults.fault import ALL, Fault, FaultLayer
from hil.emulated.faults.motor import on_shaft
from hil.emulated.faults.shaft_fault import ShaftFault
from hil.verdict.part import Part

WINDING = FaultLayer.WINDING
NEIGHBOUR = {
    Channel.INDEX: Channel.MIDDLE,
    Channel.MIDDLE: Channel.RING,
    Channel.RING: Channel.PINKY,
    Channel.THUMB_CMC_FLEXION: Channel.THUMB_FLEXOR,
}
"""Channel to the one with which it is exchanged."""


class Reversed(ShaftFault):
    """A cable wound in the opposite direction, or a motor with exchanged poles."""

    def changed(self, drive: Drive) -> Drive:
        """Return the drive with opposite sign."""
        return replace(drive, setpoint=-drive.setpoint, torque=-drive.torque)

    def seen(self, values: Floats) -> Floats:
        """Return the values with the sign of the faulty shaft reversed, (7,)."""
        if self.active:
            values[self.shaft] *= -1.0
        return values


class Exchanged(ShaftFault):
    """Two servos with exchanged cables."""

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

    def seen(self, values: Floats) -> Floats:
        """Return the values with the two shafts exchanged, (7,)."""
        return values[self._order]

    def renew(self) -> None:
        """Do nothing, because the fault is built in."""


# fmt: off
FAULTS = (
    Fault("winding_reversed", WINDING, Part.DIGIT, "a cable is wound the other way round",
          on_shaft(lambda assembly, fault: Reversed(assembly.shafts, fault.where)), ALL, later=False),
    Fault("finger_cables_swapped", WINDING, Part.DIGIT, "two fingers' cables are exchanged",
          on_shaft(lambda assembly, fault: Exchanged(assembly.shafts, fault.where)), FINGERS[:3], later=False),
    Fault("thumb_cables_swapped", WINDING, Part.DIGIT, "the two thumb cables are exchanged",
          on_shaft(lambda assembly, fault: Exchanged(assembly.shafts, fault.where)),
          (Channel.THUMB_CMC_FLEXION,), later=False),
)
# fmt: on
