"""Ordinary least squares with what it takes to judge a fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil.lab.map_identification.captures import Capture

Floats = NDArray[np.float64]
Design = Callable[[Floats, Floats, Floats], tuple[Floats, ...]]

_ORIGIN = (0.875, 0.0325, 0.0975)
"""Middle of abduction (rad) and of both cables (m); products are taken around it to keep them well conditioned."""

DESIGNS: dict[str, Design] = {
    "first order": lambda a, x, y: (a, x, y),
    "bilinear": lambda a, x, y: (a, x, y, (x - _ORIGIN[1]) * (y - _ORIGIN[2])),
    "quadratic": lambda a, x, y: (
        *(a, x, y, (x - _ORIGIN[1]) * (y - _ORIGIN[2])),
        *((x - _ORIGIN[1]) ** 2, (y - _ORIGIN[2]) ** 2),
    ),
}
"""Regressors from abduction (rad), CMC cable and flexor cable (m); a constant is always added last."""


@dataclass(frozen=True)
class Fit:
    """One least squares fit of several targets."""

    coefficients: Floats
    """(targets, regressors)."""
    standard_errors: Floats
    """Same shape; robust against errors that go together within a sweep."""
    r_squared: Floats
    """(targets,)."""
    residuals: Floats
    """(n, targets), target minus fit."""


def regressors(design: str, capture: Capture) -> Floats:
    """Return the regressors of a capture's thumb, (n, k); abduction is left out where it was held."""
    abduction, cmc, flexor = capture.lengths[:, 4:].T
    columns = (*DESIGNS[design](abduction, cmc, flexor), np.ones_like(cmc))
    held = np.ptp(abduction) < np.deg2rad(10.0)
    return np.column_stack(columns[1:] if held else columns)


def least_squares(x: Floats, targets: Floats, sweep: NDArray[np.int64]) -> Fit:
    """Fit `targets` (n, t) by `x` (n, k).

    What a first-order fit leaves is misfit and no noise: it is the same along a whole sweep, so samples do not count as
    independent. The standard errors are cluster-robust over sweeps (Liang and Zeger), with the usual factor
    for few clusters.

    Raises:
        ValueError: the regressors do not span their space, or a target is constant; something was not moved.
    """
    if np.linalg.matrix_rank(x / np.abs(x).max(axis=0)) < x.shape[1]:
        raise ValueError("the sweeps do not tell the coefficients apart; a channel was not moved on its own")
    spread = ((targets - targets.mean(axis=0)) ** 2).sum(axis=0)
    if not spread.all():
        raise ValueError(f"target {int(np.argmin(spread))} is constant; the sweeps did not move it")
    solution = np.asarray(np.linalg.lstsq(x, targets, rcond=None)[0], np.float64)
    residuals: Floats = targets - x @ solution
    return Fit(
        solution.T,
        _cluster_robust(x, residuals, sweep),
        1.0 - (residuals**2).sum(axis=0) / spread,
        residuals,
    )


def _cluster_robust(x: Floats, residuals: Floats, sweep: NDArray[np.int64]) -> Floats:
    inverse = np.linalg.inv(x.T @ x)
    labels = np.unique(sweep)
    scores = np.stack([x[sweep == label].T @ residuals[sweep == label] for label in labels])
    middle = np.einsum("skt,slt->tkl", scores, scores) * len(labels) / (len(labels) - 1)
    variances: Floats = np.einsum("ij,tjk,ki->ti", inverse, middle, inverse)
    errors: Floats = np.sqrt(variances)
    return errors
