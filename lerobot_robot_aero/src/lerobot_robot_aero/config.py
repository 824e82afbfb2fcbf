"""What the command line of LeRobot may say about a hand.

No annotations as strings here: LeRobot's parser reads the types of the fields.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from lerobot.cameras import CameraConfig
from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig

from model.units.cable_correction import TYPICAL

EMULATED = "emulated"
"""Port of a hand without hardware."""


@dataclass(kw_only=True)
class ChosenHandConfig:
    """One hand, on a port or emulated."""

    port: str
    """Device path or pyserial URL of the hand, a name in `hands.toml`, or `emulated`: its own process, in real time."""
    side: Literal["right", "left"] | None = None
    """Side of the hand; None for what `hands.toml` says, else right."""
    firmware: str | None = None
    """Version that the hand runs, or that is emulated; None for what `hands.toml` says, else the default."""
    unit: str = "reference"
    """Of an emulated hand: shipped name, `plausible:SEED` or `.toml` path."""
    seed: int = 0
    """Of an emulated hand's noise."""
    fault: str = ""
    """Of an emulated hand: faults as `aero-hil faults` lists them, with blanks between."""
    correction: str = TYPICAL
    """Whose correction of the cables: `typical` of healthy hands, `none`, or a unit, a file of `aero-hil calibrate`."""


@RobotConfig.register_subclass("aero_hand")
@dataclass(kw_only=True)
class AeroHandRobotConfig(RobotConfig, ChosenHandConfig):
    """The robot `aero_hand`."""

    currents: bool = False
    """Whether observations hold the motor currents, A, besides the angles."""
    max_relative_target: float | None = None
    """How far one action may be from where the hand stands, degrees; None for any distance."""
    cameras: dict[str, CameraConfig] = field(default_factory=dict)
    """Cameras of LeRobot, by name."""


@TeleoperatorConfig.register_subclass("aero_twin")
@dataclass(kw_only=True)
class AeroTwinConfig(TeleoperatorConfig, ChosenHandConfig):
    """The teleoperator `aero_twin`: another hand on `port`, or a `recording` in place of one."""

    port: str = ""
    """As of the robot; empty when a recording is played."""
    limp: bool = True
    """Whether the hand on `port` is let go so that it can be moved; otherwise it is only read."""
    recording: Path | None = None
    """MCAP file of aero-hil whose position commands are played."""
    repeat: bool = True
    """Whether a recording begins again after its end; otherwise its last command stays."""

    def __post_init__(self) -> None:
        """Raise ValueError unless there is either a port or a recording."""
        if bool(self.port) == (self.recording is not None):
            raise ValueError("aero_twin follows another hand or plays a recording: give either a port or a recording")
