"""Uncertainty of fitted numbers: 95 % intervals from the slopes at the solution and the prior."""

from collections.abc import Callable, Mapping, Sequence
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from aero.floats import Floats
from aero_hil_toml import filled, parsed
from train.identification.search import NOISE_COUNTS, OUTLIER_COUNTS
from train.identification.unit_parameters import Free, Residuals

COVERAGE_SIGMA = 1.96
"""Half width of a 95 % interval over the standard deviation."""
LONGEST_LAG = 50
"""Largest lag of the residuals' autocorrelation, readings; a second at 50 Hz."""
ROUNDING_COUNTS2 = 1.0 / 12.0

TOLD = 0.8
"""Threshold of the ratio of an interval's width to the prior's; above it the readings do not determine the number."""

FILE = "interval_factors.toml"
"""File in `hil/data` with the factors on the intervals' standard deviations, by kind of number. Source: `python -m
figures.intervals` on emulated hands with known numbers. Slopes and misfit miss some errors, such as an unfinished
search."""

Intervals = dict[str, tuple[Floats, Floats]]
"""Lower and upper bounds of a field's entries, by `section.field`; equal bounds mark an entry that was not fitted."""


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

    The errors have three causes: the prior, the residuals, and fixed numbers with an effect on the readings. Residuals
    are misfit rather than noise and autocorrelated, so the number of independent residuals is smaller than that of the
    readings.

    Args:
        residuals: residuals at the solution.
        slopes: slopes of the free numbers at the solution, per trace (m, 7, p).
        spread: prior standard deviations of the free numbers, (p,).
        hidden: slopes of the fixed numbers, per trace (m, 7, q).
        hidden_spread: prior standard deviations of the fixed numbers, (q,).
        noise: standard deviation of a reading assumed by the search, counts.
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
    """Return the variance of the mean of autocorrelated residuals, times their number, counts²."""
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
    """Return masks of the entries with clearly narrower intervals than the prior's, by `section.field`."""
    return {name: (high - low) < TOLD * (believed[name][1] - believed[name][0]) for name, (low, high) in known.items()}


def widened(errors: Floats, factor: Floats, spread: Floats) -> Floats:
    """Return the covariance with standard deviations multiplied by `factor`, at most the prior's.

    Args:
        errors: covariance of the free numbers, (p, p).
        factor: factors on the standard deviations, (p,).
        spread: prior standard deviations, (p,).
    """
    deviation = np.sqrt(np.diag(errors))
    scale = np.minimum(factor * deviation, spread) / np.maximum(deviation, np.finfo(float).tiny)
    wider: Floats = errors * np.outer(scale, scale)
    return wider


def intervals(numbers: Callable[[Floats], Mapping[str, Floats]], x: Floats, errors: Floats) -> Intervals:
    """Return the 95 % interval of every field that depends on the free numbers.

    Args:
        numbers: map from free numbers to fields, arrays by name.
        x: free numbers, (p,).
        errors: covariance of the free numbers, (p, p).
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
        # The interval of a number with a fixed sign is a factor.
        factor = np.exp(np.divide(half, np.abs(value), out=np.zeros_like(half), where=value != 0.0))
        found[name] = np.where(half, value / factor, value), np.where(half, value * factor, value)
    return found


def interval_factors() -> dict[str, float]:
    """Return the factor of each kind of number, by `section.field` or section."""
    text = (resources.files("hil") / "data" / FILE).read_text(encoding="utf-8")
    return filled(dict[str, float], parsed(text, FILE)["factors"], FILE)


def factors_of(free: Sequence[Free], factors: Mapping[str, float]) -> Floats:
    """Return the factor of each free number, (p,), by its field or else by its section."""
    fields = [number.name.replace("spring_rise", "spring_closed") for number in free]
    return np.array([factors.get(field, factors[field.split(".")[0]]) for field in fields])
