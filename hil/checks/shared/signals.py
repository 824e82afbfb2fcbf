"""Small operations on sampled signals that several experiments share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def at_times(times: Floats, values: Floats, at: Floats) -> Floats:
    """Interpolate each column of `values` (n, k) linearly to the times `at`; returns (m, k)."""
    return np.stack([np.interp(at, times, column) for column in values.T], axis=1)


def display_unit(unit: str) -> tuple[str, float]:
    """Return the unit in which people read `m` or `rad`, and the factor to it."""
    return {"m": ("mm", 1e3), "rad": ("mrad", 1e3)}[unit]


def rms(values: Floats) -> float:
    """Return the root mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else np.nan
