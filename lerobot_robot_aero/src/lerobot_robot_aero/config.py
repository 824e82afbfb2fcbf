"""Configurations for LeRobot's command line.

No `from __future__ import annotations` here, because LeRobot's parser reads the field types.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from lerobot.cameras import CameraConfig
from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig

from model.units.cable_correction import TYPICAL

EMULATED = "emulated"
"""Port name of an emulated hand."""


@dataclass(kw_only=True)
class ChosenHandConfig:
    """Configuration of a hand, on a port or emulated."""

    port: str
    """Device path or pyserial URL of the hand, a name in `hands.toml`, or `emulated` (separate process, real time)."""
    side: Literal["right", "left"] | None = None
    """Side of the hand; None for the side in `hands.toml`, else right."""
    firmware: str | None = None
    """Firmware version of the hand or emulator; None for the version in `hands.toml`, else the default."""
    unit: str = "reference"
    """Unit of an emulated hand: shipped name, `plausible:SEED` or `.toml` path."""
    seed: int = 0
    """Seed of an emulated hand's noise."""
    fault: str = ""
    """Faults of an emulated hand, as listed by `aero-hil faults`, separated by blanks."""
    correction: str = TYPICAL
    """Cable correction: `typical` of healthy hands, `none`, or that of a unit (file of `aero-hil calibrate`)."""


@RobotConfig.register_subclass("aero_hand")
@dataclass(kw_only=True)
class AeroHandRobotConfig(RobotConfig, ChosenHandConfig):
    """Configuration of the robot `aero_hand`."""

    currents: bool = False
    """Whether observations include the motor currents, A."""
    max_relative_target: float | None = None
    """Largest difference of an action from the present angles, degrees; None for no limit."""
    cameras: dict[str, CameraConfig] = field(default_factory=dict)
    """LeRobot cameras, by name."""


@TeleoperatorConfig.register_subclass("aero_twin")
@dataclass(kw_only=True)
class AeroTwinConfig(TeleoperatorConfig, ChosenHandConfig):
    """Configuration of the teleoperator `aero_twin`: another hand on `port`, or a `recording`."""

    port: str = ""
    """Port of the other hand, as for the robot; empty for a recording."""
    limp: bool = True
    """Whether to set the torque of the hand on `port` to zero, so that it can be moved by hand."""
    recording: Path | None = None
    """MCAP file of aero-hil with position commands to play."""
    repeat: bool = True
    """Whether a recording repeats after its end; otherwise its last command is held."""

    def __post_init__(self) -> None:
        """Raise ValueError unless there is either a port or a recording."""
        if bool(self.port) == (self.recording is not None):
            raise ValueError("aero_twin follows another hand or plays a recording: give either a port or a recording")
