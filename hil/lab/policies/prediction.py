"""What a set of trials says about how a policy will do, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest, bootstrap

from hil.lab.policies.cube_trial import CubeTrial

CONFIDENCE = 0.95
RESAMPLES = 9999
LEAST = 3
"""Trials below which nothing is said about how far a mean is from the truth."""

Interval = tuple[float, float]


@dataclass(frozen=True)
class Prediction:
    """What came of a set of trials."""

    name: str
    """Where they were made."""
    trials: int
    kept: int
    """Trials at whose end the cube was still in the hand."""
    kept_interval: Interval
    """Wilson's interval of the share that is kept."""
    rate_rad_s: float
    """Mean over the trials of the angular velocity about the vertical while the cube was held, rad/s."""
    rate_interval: Interval
    """Bootstrapped interval of the mean; NaN with fewer than `LEAST` trials."""
    turned_rad: float
    """Median rotation until the end or the loss, rad."""


def share(flags: Sequence[bool]) -> tuple[float, Interval]:
    """Return the share of what is so, with Wilson's interval; NaN and all that can be without any."""
    if not flags:
        return np.nan, (0.0, 1.0)
    found = binomtest(sum(flags), len(flags)).proportion_ci(CONFIDENCE, method="wilson")
    return sum(flags) / len(flags), (float(found.low), float(found.high))


def predicted(
    name: str, kept: Sequence[bool], rates: Sequence[float], turned: Sequence[float], seed: int
) -> Prediction:
    """Return what a set of trials says.

    Args:
        name: where they were made.
        kept: of each trial, whether the cube was kept.
        rates: of each trial, rad/s.
        turned: of each trial, rad.
        seed: of the bootstrap.

    Raises:
        ValueError: there is no trial.
    """
    if not kept:
        raise ValueError("nothing can be predicted from no trial")
    return Prediction(
        name,
        len(kept),
        int(np.sum(kept)),
        share(kept)[1],
        float(np.mean(rates)),
        _of_mean(rates, seed),
        float(np.median(turned)),
    )


def of_trials(name: str, trials: Sequence[CubeTrial], seed: int) -> Prediction:
    """Return what trials through the bytes say."""
    return predicted(
        name,
        [one.kept for one in trials],
        [one.rate_rad_s for one in trials],
        [one.rotation_rad for one in trials],
        seed=seed,
    )


def _of_mean(values: Sequence[float], seed: int) -> Interval:
    if len(values) < LEAST:
        return (np.nan, np.nan)
    if np.ptp(values) == 0.0:
        return (float(values[0]), float(values[0]))
    found = bootstrap((values,), np.mean, confidence_level=CONFIDENCE, n_resamples=RESAMPLES, rng=seed)
    return (float(found.confidence_interval.low), float(found.confidence_interval.high))
