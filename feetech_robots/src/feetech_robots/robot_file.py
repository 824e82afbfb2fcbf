"""Description of a robot of bus servos in TOML: an MJCF file, and model, ID and mounting of each servo.

    mjcf = "arm.xml"                # relative to this file

    [[servos]]
    id = 1
    model = "STS3215"               # shipped name, or a .toml file relative to this one
    joint = "shoulder_pan"
    direction = 1                   # 1 if counts grow with the joint's angle, else -1
    zero_counts = 2048              # reading at joint angle zero
    gear = 1.0                      # turns of the servo per turn of the joint
    start_deg = 0.0                 # joint angle at time zero
    joint_damping = 0.1             # N m s/rad, without back-EMF; default: that of the MJCF file
    physics = {stall_torque = 1.9}  # fields of ServoParameters other than the model's

`id`, `model` and `joint` are required; defaults of the others: 1, 2048, 1, 0, and none for the last two.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from aero.regular_file import read_text
from aero_hil_toml import filled, parsed
from firmware_emulator.servo.parameters import ServoParameters

LARGEST_ID, LARGEST = 253, 1e6
RANGES = {
    "stall_torque": (1e-6, 1e4),
    "voltage": (0.1, 25.5),
    "start_temperature_c": (-40.0, 150.0),
    "rest_temperature_c": (-40.0, 150.0),
    "loop_period_s": (1e-5, 1.0),
    "refresh_period_s": (1e-5, 1.0),
    "current_filter_s": (1e-6, 10.0),
    "cooling_s": (1e-3, 1e6),
    "motor_s": (1e-3, 1e6),
    "full_duty_units": (1.0, 32767.0),
    "current_blocked_counts": (0.0, math.inf),
    "current_fading_counts": (0.0, math.inf),
}
"""Ranges of `ServoParameters` fields with other bounds than the default."""


@dataclass(frozen=True)
class RobotServo:
    """Servo and its joint."""

    id: Annotated[int, Meta(ge=0, le=LARGEST_ID)]
    """Bus ID; duplicates are allowed, as with a servo that was never set up."""
    model: str
    """Model name, for `servo.models.model_of`."""
    joint: str
    """Name of a hinge joint of the MJCF file."""
    direction: Literal[1, -1] = 1
    """Direction: 1 if counts grow with the joint's angle, else -1."""
    zero_counts: Annotated[float, Meta(ge=-LARGEST, le=LARGEST)] = 2048.0
    """Reading at joint angle zero without offset, counts."""
    gear: Annotated[float, Meta(gt=0.0)] = 1.0
    """Turns of the servo per turn of the joint."""
    start_deg: Annotated[float, Meta(ge=-3600.0, le=3600.0)] = 0.0
    """Joint angle at time zero, degrees."""
    joint_damping: Annotated[float, Meta(ge=0.0)] | None = None
    """Damping of the joint without back-EMF, N m s/rad; None for the value of the MJCF file."""
    physics: Mapping[str, float] = field(default_factory=dict)
    """Fields of `ServoParameters` that override the model's data sheet."""

    @property
    def parameters(self) -> ServoParameters:
        """Servo model and physical parameters.

        Raises:
            ValueError: an unknown model or field, or a number out of range.
        """
        parameters = ServoParameters.of_model(self.model, **self.physics)
        for name, value in vars(parameters).items():
            low, high = RANGES.get(name, (0.0, math.inf))
            if isinstance(value, float) and not low <= value <= high:
                raise ValueError(f"servo model {self.model}: {name} is {low:g} to {high:g}, not {value:g}")
        return parameters


@dataclass(frozen=True)
class Robot:
    """Content of a robot file."""

    mjcf: Path
    """Path of the MJCF file."""
    servos: Annotated[tuple[RobotServo, ...], Meta(min_length=1)]
    """Servos in the order of the file."""

    def joints(self) -> dict[str, int]:
        """Return the index of each servo by joint name."""
        return {servo.joint: place for place, servo in enumerate(self.servos)}


def read_robot(path: Path) -> Robot:
    """Read a robot file.

    Raises:
        ValueError: a value is missing, unknown or out of range; the message names file and servo.
        OSError: the file, or the file of a servo's model, cannot be read.
    """
    try:
        robot = filled(Robot, parsed(read_text(path), str(path)), str(path))
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is not TOML: {error}") from error
    joints = [servo.joint for servo in robot.servos]
    if doubled := {joint for joint in joints if joints.count(joint) > 1}:
        raise ValueError(f"{path}: two servos turn {', '.join(sorted(doubled))}")
    servos = tuple(
        replace(servo, model=str(path.parent / servo.model)) if servo.model.endswith(".toml") else servo
        for servo in robot.servos
    )
    for number, servo in enumerate(servos):
        try:
            _ = servo.parameters
        except ValueError as error:
            raise ValueError(f"{path}.servos[{number}]: {error}") from error
    return Robot(path.parent / robot.mjcf, servos)
