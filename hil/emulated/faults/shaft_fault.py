"""Faults between a servo's shaft and the mechanics: a wrapper of a plant that changes one channel."""

from dataclasses import replace

from aero.floats import Floats
from firmware_emulator.plant import Drive, Plant, ShaftState


class ShaftFault:
    """Fault of one shaft: forwards every call, and changes drives or readings after `begin`; can be nested."""

    def __init__(self, behind: Plant, shaft: int) -> None:
        self.behind = behind
        self.shaft = shaft
        self.active = False
        self.asked = Drive(powered=False)
        """Drive that the servo requests."""

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.behind.time

    def begin(self) -> None:
        """Take effect now."""
        self.active = True
        self.renew()

    def end(self) -> None:
        """Clear the effect; the caller then renews the drives of the plant behind."""
        self.active = False

    @property
    def supply_left(self) -> float:
        """Supply voltage of the motors, as a fraction of the voltage without the fault."""
        return 1.0

    def advance_to(self, t: float) -> None:
        """Integrate to `t`, s."""
        self.behind.advance_to(t)

    def drive(self, shaft: int, drive: Drive) -> None:
        """Replace the drive of a shaft."""
        if shaft == self.shaft:
            self.asked = drive
            drive = self.changed(drive) if self.active else drive
        self.behind.drive(shaft, drive)

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change the goal angle of a shaft, rad."""
        if shaft != self.shaft:
            self.behind.set_setpoint(shaft, setpoint)
            return
        self.asked = replace(self.asked, setpoint=setpoint)
        self.renew()

    def state(self) -> ShaftState:
        """Return angles, speeds and efforts of the shafts at once."""
        return ShaftState(self.angles().tolist(), self.speeds().tolist(), self.efforts().tolist())

    def angles(self) -> Floats:
        """Return shaft angles, (7,), rad."""
        return self.seen(self.behind.angles())

    def speeds(self) -> Floats:
        """Return shaft speeds, (7,), rad/s."""
        return self.seen(self.behind.speeds())

    def efforts(self) -> Floats:
        """Return the efforts of the drives, (7,), N m."""
        return self.seen(self.behind.efforts())

    def seen(self, values: Floats) -> Floats:
        """Return the readings for the true angles, speeds or efforts, (7,)."""
        return values

    def renew(self) -> None:
        """Apply the present drive to the shaft."""
        drive = self.changed(self.asked) if self.active else self.asked
        self.behind.drive(self.shaft, drive)

    def changed(self, drive: Drive) -> Drive:
        """Return the drive of the shaft for the drive that its servo requests."""
        return drive
