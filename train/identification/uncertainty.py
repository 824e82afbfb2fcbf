"""Uncertainty of fitted numbers: 95 % intervals from the slopes at the solution and the prior."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from train.identification.search import NOISE_COUNTS, OUTLIER_COUNTS
from train.identification.unit_parameters import Floats, Free, Residuals

COVERAGE_SIGMA = 1.96
"""Half the width of a 95 % interval over its standard deviation."""
LONGEST_LAG = 50
"""Readings over which residuals are looked at for going together; a second at 50 Hz."""
ROUNDING_COUNTS2 = 1.0 / 12.0
"""Variance of a reading that is a whole number of counts."""

TOLD = 0.8
"""Width of an interval, as a share of what was believed before, from which on the readings have not told a number."""

FILE = "interval_factors.toml"
"""In `hil/data`: how much wider than their own standard deviations intervals have to be to hold, by kind of number.
Measured by `python -m figures.intervals` on emulated hands whose numbers are known: slopes and misfit tell less than
all of the error, such as a search that has not quite ended."""

Intervals = dict[str, tuple[Floats, Floats]]
"""Low and high of each entry of a field, by `section.field`; an entry without width was not fitted."""


def covariance(
    residuals: Residuals,
    slopes: Sequence[Floats],
    spread: Floats,
    hidden: Sequence[Floats],
    hidden_spread: Floats,
    *,
    noise: float = NOISE_COUNTS,
) -> Floats:
    """Return the covariance of the errors of the free numbers, (p, p).

    Three things make an error: the pull to the start, the residuals, and numbers that were kept where they are although
    the readings feel them. Residuals are misfit rather than noise and go together in time, so that fewer of them count
    than there are readings.

    Args:
        residuals: at the solution.
        slopes: of the free numbers there, per trace (m, 7, p).
        spread: of the free numbers, (p,).
        hidden: slopes of the kept numbers, per trace (m, 7, q).
        hidden_spread: of the kept numbers, (q,).
        noise: what the search held the residuals against, counts.
    """
    p, q = len(spread), len(hidden_spread)
    information, scatter, shared = np.zeros((p, p)), np.zeros((p, p)), np.zeros((p, q))
    for residual, slope, felt in zip(residuals, slopes, hidden, strict=True):
        for channel in range(residual.shape[1]):
            inlier = np.abs(residual[:, channel]) < OUTLIER_COUNTS
            weighted = slope[inlier, channel] / noise
            one = weighted.T @ weighted
            information += one
            scatter += one * _together(residual[inlier, channel]) / noise**2
            shared += weighted.T @ felt[inlier, channel] / noise
    prior = np.diag(spread**-2.0)
    gain = np.linalg.inv(information + prior)
    kept = shared * hidden_spread
    errors: Floats = gain @ (scatter + prior + kept @ kept.T) @ gain
    return errors


def _together(residual: Floats) -> float:
    """Return the variance that the mean of a run of residuals would have, times their number, counts²."""
    if not len(residual):
        return ROUNDING_COUNTS2
    total = float(np.mean(residual**2))
    for lag in range(1, min(LONGEST_LAG, len(residual) - 1)):
        shared = float(np.mean(residual[lag:] * residual[:-lag]))
        if shared <= 0.0:
            break
        total += 2.0 * shared
    return max(total, ROUNDING_COUNTS2)


def told(known: Intervals, believed: Intervals) -> dict[str, NDArray[np.bool_]]:
    """Return which entries the readings have made clearly better known than they were before, by `section.field`."""
    return {name: (high - low) < TOLD * (believed[name][1] - believed[name][0]) for name, (low, high) in known.items()}


def widened(errors: Floats, factor: Floats, spread: Floats) -> Floats:
    """Return errors whose standard deviations are `factor` times as large, but nowhere beyond what is believed anyway.

    Args:
        errors: covariance of the free numbers, (p, p).
        factor: by how much each is known less well than `errors` says, (p,).
        spread: what is believed of each before data are seen, (p,).
    """
    deviation = np.sqrt(np.diag(errors))
    scale = np.minimum(factor * deviation, spread) / np.maximum(deviation, np.finfo(float).tiny)
    wider: Floats = errors * np.outer(scale, scale)
    return wider


def intervals(numbers: Callable[[Floats], Mapping[str, Floats]], x: Floats, errors: Floats) -> Intervals:
    """Return the 95 % interval of every number that errors in `x` reach.

    Args:
        numbers: what the free numbers stand for, arrays by name.
        x: the free numbers, (p,).
        errors: their covariance, (p, p).
    """
    centre = numbers(x)
    variance = {name: np.zeros_like(value) for name, value in centre.items()}
    values, vectors = np.linalg.eigh(errors)
    for value, vector in zip(values, vectors.T, strict=True):
        step = np.sqrt(max(value, 0.0)) * vector
        there, back = numbers(x + step), numbers(x - step)
        for name in centre:
            variance[name] += ((there[name] - back[name]) / 2.0) ** 2
    found = {}
    for name, value in centre.items():
        half = COVERAGE_SIGMA * np.sqrt(variance[name])
        if not half.any():
            continue
        if name.endswith("take_up"):
            found[name] = value - half, value + half
            continue
        # A number that cannot change its sign is known by a factor.
        factor = np.exp(np.divide(half, np.abs(value), out=np.zeros_like(half), where=value != 0.0))
        found[name] = np.where(half, value / factor, value), np.where(half, value * factor, value)
    return found


def interval_factors() -> dict[str, float]:
    """Return the factor of each kind of number, by `section.field` or section."""
    table = tomllib.loads((resources.files("hil") / "data" / FILE).read_text(encoding="utf-8"))
    return {name: float(factor) for name, factor in table["factors"].items()}


def factors_of(free: Sequence[Free], factors: Mapping[str, float]) -> Floats:
    """Return the factor of each free number, (p,): that of its kind, else that of its section."""
    fields = [number.name.replace("spring_rise", "spring_closed") for number in free]
    return np.array([factors.get(field, factors[field.split(".")[0]]) for field in fields])
