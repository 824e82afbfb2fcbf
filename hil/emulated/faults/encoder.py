"""Encoder faults: the servo reads, and controls on, an angle other than the shaft's.

A fault stores the error of the present reading and subtracts the error from the servo's goal.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from random import Random

from aero.floats import Floats
from firmware_emulator.plant import Drive, Plant
from firmware_emulator.servo.parameters import RAD_PER_COUNT
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Inject, Severity
from hil.emulated.faults.motor import on_shaft
from hil.emulated.faults.shaft_fault import ShaftFault
from hil.verdict.part import Part

ENCODER = FaultLayer.ENCODER
ReadingChange = Callable[[float, float], float]
"""Maps a shaft angle, rad, and the time since the fault began, s, to a reading, rad."""


class Encoder(ShaftFault):
    """Encoder with a wrong reading."""

    def __init__(self, behind: Plant, shaft: int, reading: ReadingChange) -> None:
        super().__init__(behind, shaft)
        self._reading = reading
        self._since = 0.0
        self._read = self._error = 0.0

    def begin(self) -> None:
        """Start the fault and take a first wrong reading."""
        self._since = self.time
        self.active = True
        self._look()
        self.renew()

    def advance_to(self, t: float) -> None:
        """Integrate to `t`, s, and update the reading."""
        if t <= self.time:
            return
        super().advance_to(t)
        if self.active:
            self._look()
            if self.asked.stiffness:
                self.behind.set_setpoint(self.shaft, self.asked.setpoint - self._error)

    def angles(self) -> Floats:
        """Return the readings of the encoders, (7,), rad."""
        angles = self.behind.angles()
        if self.active:
            angles[self.shaft] = self._read
        return angles

    def changed(self, drive: Drive) -> Drive:
        """Return the drive with the encoder's error subtracted from its goal."""
        return replace(drive, setpoint=drive.setpoint - self._error)

    def _look(self) -> None:
        true = float(self.behind.angles()[self.shaft])
        self._read = self._reading(true, self.time - self._since)
        self._error = self._read - true


class Scaled(Encoder):
    """Encoder with a wrong scale of angle and speed."""

    def __init__(self, behind: Plant, shaft: int, scale: float) -> None:
        super().__init__(behind, shaft, lambda true, seconds: scale * true)
        self._scale = scale

    def speeds(self) -> Floats:
        """Return the speeds as read, (7,), rad/s."""
        speeds = self.behind.speeds()
        if self.active:
            speeds[self.shaft] *= self._scale
        return speeds


class Frozen(Encoder):
    """Encoder frozen at its first reading; the position loop then applies a constant torque."""

    def changed(self, drive: Drive) -> Drive:
        """Return a constant torque, that of the loop at the frozen reading."""
        torque = drive.torque + drive.stiffness * (drive.setpoint - self._read)
        return replace(drive, setpoint=0.0, stiffness=0.0, damping=0.0, torque=torque)

    def advance_to(self, t: float) -> None:
        """Integrate to `t`, s."""
        self.behind.advance_to(t)

    def speeds(self) -> Floats:
        """Return speeds, (7,), rad/s, with zero for the frozen encoder."""
        speeds = self.behind.speeds()
        if self.active:
            speeds[self.shaft] = 0.0
        return speeds


class Play:
    """Backlash of a loose magnet on its shaft, rad."""

    def __init__(self, play: float) -> None:
        self._half = 0.5 * play
        self._at = 0.0

    def __call__(self, true: float, seconds: float) -> float:
        """Return the angle of the magnet, rad."""
        self._at = min(max(self._at, true - self._half), true + self._half)
        return self._at


def _quantised(counts: float, random: Random) -> ReadingChange:
    step = counts * RAD_PER_COUNT
    return lambda true, seconds: step * math.floor(true / step + 0.5)


def _noisy(counts: float, random: Random) -> ReadingChange:
    return lambda true, seconds: true + random.gauss(0.0, counts * RAD_PER_COUNT)


def _encoder(make: Callable[[float, Random], ReadingChange]) -> Inject:
    return on_shaft(
        lambda assembly, fault: Encoder(assembly.shafts, fault.where, make(fault.severity, assembly.random(fault)))
    )


def _offset(counts: float, random: Random) -> ReadingChange:
    return lambda true, seconds: true + counts * RAD_PER_COUNT


ZERO = Severity("counts", (40, 120, 400), -2048, 2048)
# fmt: off
FAULTS = (
    Fault("encoder_scale", ENCODER, Part.SERVO, "encoder scale error",
          on_shaft(lambda assembly, fault: Scaled(assembly.shafts, fault.where, fault.severity)),
          ALL, Severity("factor", (1.02, 1.05, 1.2), 0.5, 2)),
    # SETUP is an alternative part, because homing corrects a zero that was displaced once, whatever the cause.
    Fault("encoder_offset", ENCODER, Part.SERVO, "an encoder's zero is displaced",
          _encoder(_offset), ALL, ZERO, alike=(Part.SETUP,)),
    Fault("encoder_slip", ENCODER, Part.SERVO, "a magnet slips once",
          _encoder(_offset), ALL, ZERO, 10.0, alike=(Part.SETUP,)),
    Fault("encoder_creep", ENCODER, Part.SERVO, "an encoder's zero creeps",
          _encoder(lambda rate, _: lambda true, seconds: true + rate * seconds * RAD_PER_COUNT),
          ALL, Severity("counts/s", (0.5, 2, 10), -100, 100)),
    Fault("encoder_noise", ENCODER, Part.SERVO, "an encoder is noisy",
          _encoder(_noisy), ALL, Severity("counts rms", (3, 10, 40), 0, 1024)),
    Fault("encoder_frozen", ENCODER, Part.SERVO, "frozen encoder",
          on_shaft(lambda assembly, fault: Frozen(assembly.shafts, fault.where, lambda true, seconds: true)), ALL),
    Fault("encoder_quantised", ENCODER, Part.SERVO, "coarse encoder resolution",
          _encoder(_quantised), ALL, Severity("counts", (8, 16, 64), 1, 1024)),
    Fault("encoder_play", ENCODER, Part.SERVO, "backlash at a shaft",
          _encoder(lambda play, _: Play(play * RAD_PER_COUNT)), ALL, Severity("counts", (15, 40, 150), 0, 2048)),
)
# fmt: on
