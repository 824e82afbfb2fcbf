"""When a run of a policy ends for the loop's own reasons; what may hurt the hand is watched by `aero.safety`."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Ending(Enum):
    """Why a run of a policy ended."""

    TIME = "the time was over"
    STOPPED = "the guard stopped the hand"
    READINGS = "too many readings in a row were missing"
    OVERRUN = "the loop fell too far behind its period"


@dataclass(frozen=True)
class RunLimits:
    """Bounds within which a policy may continue.

    Raises:
        ValueError: a bound that is not finite and positive, or a count that is not a whole number from 0 on.
    """

    missing_readings: int = 4
    """Readings in a row that may be missing; nothing new is commanded meanwhile."""
    late_s: float = 0.5
    """Time by which the loop may miss a period's start, s."""
    shaft_speed_rad_s: float = 12.9
    """Fastest commanded change of a shaft; the servo's own no-load speed, 740 °/s."""

    def __post_init__(self) -> None:
        checked_count("missing_readings", self.missing_readings)
        for field in fields(self)[1:]:
            checked_number(field.name, getattr(self, field.name), above=0.0)


def checked_number(name: str, value: float, *, least: float = -inf, above: float = -inf) -> None:
    """Refuse a number that is not finite, or out of its range.

    Raises:
        ValueError: with name, range and value. A comparison alone would let NaN through, and a NaN reaches the hand as
            a position.
    """
    if not (isfinite(value) and value >= least and value > above):
        wanted = f" and above {above:g}" if above > -inf else f" and at least {least:g}" if least > -inf else ""
        raise ValueError(f"{name} must be finite{wanted}, got {value}")


def checked_count(name: str, value: int, least: int = 0) -> None:
    """Refuse what is not a whole number from `least` on.

    Raises:
        ValueError: with name, range and value.
    """
    if not (isfinite(value) and value == int(value) and value >= least):
        raise ValueError(f"{name} must be a whole number from {least} on, got {value}")


def slewed(before: Floats, wanted: Floats, most: Floats) -> Floats:
    """Return `wanted` (7,), each channel at most `most` (7,) away from `before`."""
    step: Floats = np.clip(wanted - before, -most, most)
    return before + step
