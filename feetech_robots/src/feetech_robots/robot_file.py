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

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, get_type_hints

from aero.regular_file import read_text
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

    id: int
    """Bus ID, 0 to 253; duplicates are allowed, as with a servo that was never set up."""
    model: str
    """Model name, for `servo.models.model_of`."""
    joint: str
    """Name of a hinge joint of the MJCF file."""
    direction: int = 1
    """Direction: 1 if counts grow with the joint's angle, else -1."""
    zero_counts: float = 2048.0
    """Reading at joint angle zero without offset, counts."""
    gear: float = 1.0
    """Turns of the servo per turn of the joint, positive."""
    start_deg: float = 0.0
    """Joint angle at time zero, degrees."""
    joint_damping: float | None = None
    """Damping of the joint without back-EMF, N m s/rad; None for the value of the MJCF file."""
    physics: Mapping[str, float] = field(default_factory=dict)
    """Fields of `ServoParameters` that override the model's data sheet."""

    def __post_init__(self) -> None:
        if not 0 <= self.id <= LARGEST_ID:
            raise ValueError(f"an id is 0 to {LARGEST_ID}, not {self.id}")
        if self.direction not in (1, -1):
            raise ValueError(f"a direction is 1 or -1, not {self.direction}")
        if not (math.isfinite(self.gear) and self.gear > 0.0):
            raise ValueError(f"a gear is positive, not {self.gear}")
        for name, value, largest in (("zero_counts", self.zero_counts, 1e6), ("start_deg", self.start_deg, 3600.0)):
            if not -largest <= value <= largest:
                raise ValueError(f"{name} is -{largest:g} to {largest:g}, not {value:g}")
        if self.joint_damping is not None and not 0.0 <= self.joint_damping < math.inf:
            raise ValueError(f"a joint_damping is not negative, not {self.joint_damping}")

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
    servos: tuple[RobotServo, ...]
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
        content = tomllib.loads(read_text(path))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a TOML file: {error}") from error
    if unknown := content.keys() - {"mjcf", "servos"}:
        raise ValueError(f"{path}: unknown {', '.join(sorted(unknown))}; a robot has mjcf and servos")
    if not isinstance(content.get("mjcf"), str) or not isinstance(content.get("servos"), list) or not content["servos"]:
        raise ValueError(f"{path}: a robot has mjcf, the path of a file, and [[servos]], one or more")
    servos = tuple(_servo(row, path, number) for number, row in enumerate(content["servos"], 1))
    joints = [servo.joint for servo in servos]
    if doubled := {joint for joint in joints if joints.count(joint) > 1}:
        raise ValueError(f"{path}: two servos turn {', '.join(sorted(doubled))}")
    return Robot(path.parent / content["mjcf"], servos)


def _servo(row: Mapping[str, Any], path: Path, number: int) -> RobotServo:
    known = {field.name for field in fields(RobotServo)}
    try:
        if unknown := row.keys() - known:
            raise ValueError(f"unknown {', '.join(sorted(unknown))}; a servo has {', '.join(sorted(known))}")
        if missing := {"id", "model", "joint"} - row.keys():
            raise ValueError(f"{', '.join(sorted(missing))} missing")
        hints = get_type_hints(RobotServo)
        for name, value in row.items():
            numeric = (int, float)
            wanted: Any = {int: int, float: numeric, float | None: numeric, str: str}.get(hints[name], dict)
            if not isinstance(value, wanted) or isinstance(value, bool):
                raise ValueError(f"{name} cannot be {value!r}")
        model = row["model"]
        servo = RobotServo(**{**row, "model": str(path.parent / model) if model.endswith(".toml") else model})
        # Evaluated here so that errors in the parameters name this file.
        _ = servo.parameters
    except ValueError as error:
        raise ValueError(f"{path}: servo {number}: {error}") from error
    return servo
