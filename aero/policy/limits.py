"""When a policy must stop: currents, temperatures and readings that a hand should not have to bear."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel


class Ending(Enum):
    """Why a run of a policy ended."""

    TIME = "the time was over"
    CURRENT = "a motor current was over its limit"
    TEMPERATURE = "a servo was too hot"
    READINGS = "too many readings in a row were missing"
    OVERRUN = "the loop fell too far behind its period"


@dataclass(frozen=True)
class Limits:
    """Bounds within which a policy may go on; the defaults lie inside what owners ran without damage."""

    current_a: float = 3.5
    """Motor current of any channel, A; the register saturates at 4.6 A with the default torque limit."""
    current_s: float = 0.5
    """Time for which a channel may be over it, s; a start of motion may be."""
    temperature_c: float = 65.0
    """Servo temperature, °C; firmware 0.2.0 acts at 70."""
    missing_readings: int = 4
    """Readings in a row that may be missing; nothing new is commanded meanwhile."""
    late_s: float = 0.5
    """Time by which the loop may miss a period's start, s."""
    shaft_speed_rad_s: float = 12.9
    """Fastest commanded change of a shaft; the servo's own no-load speed, 740 °/s."""

    def __post_init__(self) -> None:
        if min(self.current_a, self.temperature_c, self.late_s, self.shaft_speed_rad_s) <= 0 or self.current_s < 0:
            raise ValueError(f"limits must be positive, got {self}")


class OverCurrent:
    """How long each channel has been over the current limit."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._since = np.full(len(Channel), np.nan)

    def seen(self, now: float, currents_a: NDArray[np.float64]) -> bool:
        """Take a reading (7,) at `now` (s); return whether a channel has been over its limit for too long."""
        over = np.abs(currents_a) > self._limits.current_a
        self._since = np.where(over, np.where(np.isnan(self._since), now, self._since), np.nan)
        return bool(np.any(now - self._since[over] >= self._limits.current_s))


def slewed(before: NDArray[np.float64], wanted: NDArray[np.float64], most: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `wanted` (7,), each channel at most `most` (7,) away from `before`."""
    step: NDArray[np.float64] = np.clip(wanted - before, -most, most)
    return before + step
