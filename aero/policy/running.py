"""Settings, steps and result of a policy run; `aero.safety` guards the hand meanwhile."""

import tomllib
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.floats import Floats
from aero.policy.settings import PolicySettings, checked_number
from aero.policy.task import CHANNELS, ShownAction


class Ending(Enum):
    """Reason for the end of a policy run."""

    TIME = "the time was over"
    STOPPED = "the guard stopped the hand"
    READINGS = "too many readings in a row were missing"
    OVERRUN = "the loop fell too far behind its period"
    TOO_SLOW = "the time was over, with too many periods skipped"


TYPICAL_CORRECTION_FILE = "typical_correction.toml"
NO_CORRECTION = (0.0,) * CHANNELS
"""Correction of a hand that matches the actuation map exactly."""


@cache
def typical_correction() -> tuple[float, ...]:
    """Return the mean cable-length correction of healthy hands, (7,), m, abduction rad.

    The correction is added to each length from the map. It compensates a cable-length error, which offsets the joints
    although the shaft reads correctly. CMC flexion of drawn thumbs is off by 2.8 mm on average, standard deviation
    0.8 mm, so the mean is a better guess than zero. Source: `train/typical_correction.py`.
    """
    return _typical("mean")


@cache
def correction_spread() -> tuple[float, ...]:
    """Return the standard deviation of the cable-length correction of healthy hands, (7,), m, abduction rad."""
    return _typical("standard_deviation")


def _typical(statistic: str) -> tuple[float, ...]:
    table = tomllib.loads((files("aero.policy.shipped") / TYPICAL_CORRECTION_FILE).read_text(encoding="utf-8"))
    return tuple(float(table[statistic][channel.label]) for channel in Channel)


def slewed(before: Floats, wanted: Floats, most: Floats) -> Floats:
    """Return `wanted` (7,), each channel clipped to `before` ± `most`, (7,) each."""
    step: Floats = np.clip(wanted - before, -most, most)
    return before + step


@dataclass(frozen=True)
class RunSettings:
    """Settings of a policy run.

    Raises:
        ValueError: a time or a correction out of range.
    """

    seconds: float = 15.0
    settings: PolicySettings | None = None
    """Nominal grasp, scales and rate; None for those of the training."""
    correction: tuple[float, ...] = field(default_factory=typical_correction)
    """Cable-length correction added to commands and subtracted from measurements, (7,), m, abduction rad."""
    approach_s: float = 1.5
    """Duration of the ramp to the nominal grasp, and of the return at the end, s."""
    wait_s: float = 1.5
    """Wait in the nominal grasp for placing the object, s."""
    dry: bool = False
    """Dry run: the policy acts on the readings, but no command is sent."""
    one_period_late: bool = False
    """Delay of each command by one period, as in the official ROS 2 node."""
    shown_action: ShownAction | None = None
    """Past action in the observation; None for that of the training. The official node shows every policy the last."""
    shaft_speed_rad_s: float = 12.9
    """Slew limit of the commands, rad/s at the shaft; default: the servo's no-load speed, 740 °/s."""

    def __post_init__(self) -> None:
        for name in ("seconds", "approach_s", "shaft_speed_rad_s"):
            checked_number(name, getattr(self, name), above=0.0)
        checked_number("wait_s", self.wait_s, least=0.0)
        if len(self.correction) != CHANNELS:
            raise ValueError(f"correction needs {CHANNELS} values in command order, got {len(self.correction)}")
        for value in self.correction:
            checked_number("correction", value)


@dataclass(frozen=True)
class Step:
    """Record of one control period; channel arrays are (7,) in command order."""

    t: float
    """Start of the period, clock s."""
    late_s: float
    """Delay of the start, s."""
    codes: NDArray[np.uint16]
    """Measured position codes."""
    lengths: Floats
    """Measured simulator lengths minus the correction, m, abduction rad."""
    observation: Floats
    """Observation given to the policy; (14,) in the cube task."""
    action: Floats
    """Clipped action of the policy."""
    target: Floats
    """Target lengths of the action, m, abduction rad."""
    command: NDArray[np.uint16]
    """Commanded position codes."""
    saturated: NDArray[np.bool_]
    """Mask of channels with a target outside the command window."""
    limited: NDArray[np.bool_]
    """Mask of channels clipped by the slew limit."""
    currents_a: Floats
    """Motor currents after the command, A; NaN for a missing reading."""


@dataclass(frozen=True)
class Run:
    """Result of a policy run."""

    ending: Ending
    reason: str
    """Message of the guard's stop; empty otherwise."""
    steps: int
    missing: int
    """Number of periods with a missing position reading, which keep the last command."""
    saturated: int
    """Number of periods with a target outside the command window."""
    limited: int
    """Number of periods with a command clipped by the slew limit."""
    latest_s: float
    """Largest delay of a period's start, s."""
    peak_current_a: float
    peak_temperature_c: float
    """Largest servo temperature, °C; NaN without a reading."""
    skipped: int = 0
    """Number of periods skipped because earlier ones overran."""
    slow: int = 0
    """Number of periods with a policy call longer than a period, in real time."""
    clipped: int = 0
