"""Servo drive for tests of the plant: position gain, damping and full effort of the recorded hand."""

from math import tau

from firmware_emulator.plant import Drive
from model import BuiltHandPlant

COUNT = tau / 4096
STALL = 0.588
STIFFNESS = STALL * 0.00862 / COUNT
DAMPING = STALL * 1.21e-4 / COUNT


def towards(angle: float, limit: float = STALL) -> Drive:
    """Drive a shaft to an angle like the recorded servos."""
    return Drive(setpoint=angle, stiffness=STIFFNESS, damping=DAMPING, limit=limit)


def push(torque: float) -> Drive:
    """Drive a shaft with a constant effort."""
    return Drive(torque=torque, limit=abs(torque))


def settle(plant: BuiltHandPlant, seconds: float = 1.5) -> None:
    """Advance the time."""
    plant.advance_to(plant.time + seconds)
