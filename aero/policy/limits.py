"""When a policy must stop for its own sake; what a hand should not have to bear is `aero.safety`'s to watch."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray


class Ending(Enum):
    """Why a run of a policy ended."""

    TIME = "the time was over"
    STOPPED = "the guard stopped the hand"
    READINGS = "too many readings in a row were missing"
    OVERRUN = "the loop fell too far behind its period"
    LOST = "the thumb draws as little as without the object"


@dataclass(frozen=True)
class RunLimits:
    """Bounds within which a policy may go on."""

    missing_readings: int = 4
    """Readings in a row that may be missing; nothing new is commanded meanwhile."""
    late_s: float = 0.5
    """Time by which the loop may miss a period's start, s."""
    shaft_speed_rad_s: float = 12.9
    """Fastest commanded change of a shaft; the servo's own no-load speed, 740 °/s."""
    grip_a: float = 0.15
    """By how much more the base of the thumb must draw with the object than in the rehearsal without it, A."""
    grip_window_s: float = 2.0
    """Time over which both are averaged, s; as long again is left out at the beginning."""

    def __post_init__(self) -> None:
        if self.missing_readings < 0 or min(self.late_s, self.shaft_speed_rad_s, self.grip_a, self.grip_window_s) <= 0:
            raise ValueError(f"limits must be positive, got {self}")


def slewed(before: NDArray[np.float64], wanted: NDArray[np.float64], most: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `wanted` (7,), each channel at most `most` (7,) away from `before`."""
    step: NDArray[np.float64] = np.clip(wanted - before, -most, most)
    return before + step
