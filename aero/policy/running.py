"""What goes into running a policy on a hand, when the loop ends the run, and what comes out of it.

What may hurt the hand is watched by `aero.safety`.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.policy.settings import PolicySettings, checked_number
from aero.policy.task import CHANNELS, ShownAction


class Ending(Enum):
    """Why a run of a policy ended."""

    TIME = "the time was over"
    STOPPED = "the guard stopped the hand"
    READINGS = "too many readings in a row were missing"
    OVERRUN = "the loop fell too far behind its period"
    TOO_SLOW = "the time was over, with too many periods skipped"


TYPICAL_CORRECTION_FILE = "typical_correction.toml"
NO_CORRECTION = (0.0,) * CHANNELS
"""For a hand that is as the actuation map describes it."""


@cache
def typical_correction() -> tuple[float, ...]:
    """Return the correction of the cables that healthy hands need on average, (7,), m, abduction rad.

    By so much longer each channel must be commanded than the map says. A cable of another length moves the joints
    behind a shaft that reads as it should. CMC flexion of drawn thumbs is off by 2.8 mm, with a standard deviation of
    0.8 mm, so the mean is a better guess than zero for an unknown hand; `train/typical_correction.py` computes it.
    """
    table = tomllib.loads((files("aero.policy.shipped") / TYPICAL_CORRECTION_FILE).read_text(encoding="utf-8"))
    return tuple(float(table["mean"][channel.label]) for channel in Channel)


def slewed(before: Floats, wanted: Floats, most: Floats) -> Floats:
    """Return `wanted` (7,), each channel at most `most` (7,) away from `before`."""
    step: Floats = np.clip(wanted - before, -most, most)
    return before + step


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RunSettings:
    """How to run a policy.

    Raises:
        ValueError: a time or a correction that cannot be used.
    """

    seconds: float = 15.0
    """Time under the policy, s."""
    settings: PolicySettings | None = None
    """Nominal grasp, scales and rate; None for those of the policy's training."""
    correction: tuple[float, ...] = field(default_factory=typical_correction)
    """By how much longer each channel of this hand must be commanded than the map says, (7,), m, abduction rad;
    taken off again from what it measures. The typical one when left out."""
    approach_s: float = 1.5
    """Time from where the hand is to the nominal grasp, and at the end back, s."""
    wait_s: float = 1.5
    """Time in the nominal grasp before the policy begins, for placing the object, s."""
    dry: bool = False
    """Whether nothing is written: the policy acts on what it reads, and the hand stays as it is."""
    one_period_late: bool = False
    """Whether each command is written a period late, as the official ROS 2 node does."""
    shown_action: ShownAction | None = None
    """Action that the policy is shown; None for the one that it was trained with. The official node shows the last
    one to every policy."""
    shaft_speed_rad_s: float = 12.9
    """Fastest commanded change of a shaft; the servo's own no-load speed, 740 °/s."""

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
    """One control period; channel arrays are (7,) in command order."""

    t: float
    """When it began, clock s."""
    late_s: float
    """How much later than its turn that was, s."""
    codes: NDArray[np.uint16]
    """Positions as read."""
    lengths: Floats
    """The same in the simulator's lengths, m, abduction rad."""
    observation: Floats
    """What the policy saw, (14,)."""
    action: Floats
    """What it did."""
    target: Floats
    """The lengths that it asked for, m, abduction rad."""
    command: NDArray[np.uint16]
    """The codes written for it."""
    saturated: NDArray[np.bool_]
    """Channels whose target lay outside the command window."""
    limited: NDArray[np.bool_]
    """Channels that were held back to the limit of the shaft's speed."""
    currents_a: Floats
    """Motor currents after the write, A; NaN where the reading is missing."""


@dataclass(frozen=True)
class Run:
    """What a run came to."""

    ending: Ending
    """Why it ended."""
    reason: str
    """What the guard saw when it stopped the hand; empty otherwise."""
    steps: int
    """Periods in which the policy acted."""
    missing: int
    """Periods in which a reading was missing and the command stayed."""
    saturated: int
    """Periods in which a target lay outside the command window."""
    limited: int
    """Periods in which the limit of the shaft's speed held a command back."""
    latest_s: float
    """Largest delay of a period's start, s."""
    peak_current_a: float
    """Largest motor current, A."""
    peak_temperature_c: float
    """Largest servo temperature, °C; NaN when none was read."""
    skipped: int = 0
    """Periods without an action, because those before took longer than a period."""
    slow: int = 0
    """Periods whose action took the policy longer than a period of real time."""
    clipped: int = 0
    """Periods in which an action was cut off at the clip."""
