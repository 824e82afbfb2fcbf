"""Fitting the model that tells where a fault sits, from the faulty hands of a campaign."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from hil.verdict.deviation import Deviation
from hil.verdict.explanation import Place
from hil.verdict.signature import Places, compressed
from hil.verdict.whereabouts import features

Floats = NDArray[np.float64]

NOTICED = 0.2
"""Median from which on a reading has a usual value that is not zero."""
SPREAD = 0.3
"""Added to the standard deviation of a feature, so that one that hardly varies is not blown up."""
PENALTY = 3.0
"""Of the squares of the weights of features in units of their spread; chosen by leaving kinds out."""
FREE = 0.04
"""Part of the penalty that the constants bear."""


def usual_readings(runs: Sequence[Places]) -> dict[str, float]:
    """Return what a reading, `experiment/metric`, is on most channels of most hands, once compressed."""
    found: dict[str, list[float]] = defaultdict(list)
    for run in runs:
        for (experiment, metric, _), place in run.items():
            if experiment != "ended":
                found[f"{experiment}/{metric}"].append(compressed(place))
    medians = {name: round(float(np.median(values)), 1) for name, values in sorted(found.items())}
    return {name: median for name, median in medians.items() if abs(median) >= NOTICED}


def fit_places(runs: Sequence[Deviation], places: Sequence[Place]) -> dict[Place, dict[str, float]]:
    """Return the weights of `Placing` that make the places of runs likeliest, small ones where little is known."""
    rows = [features(run) for run in runs]
    names = [name for name in rows[0] if any(row[name] for row in rows)]
    known = [place for place in Place if place in places]
    values = np.array([[row[name] for name in names] for row in rows])
    scale = values.std(axis=0) + SPREAD
    wanted = np.array([[place is one for one in known] for place in places], np.float64)
    weights = _fit(values / scale, wanted)
    return {
        place: {
            name: round(float(weight), 3)
            for name, weight in zip((*names, ""), (*(row[:-1] / scale), row[-1]), strict=True)
        }
        for place, row in zip(known, weights, strict=True)
    }


def _fit(values: Floats, wanted: Floats) -> Floats:
    """Return weights (places, features + 1) of a penalised multinomial logistic regression."""
    held = np.hstack([values, np.ones((len(values), 1))])
    penalty = np.full(held.shape[1], PENALTY)
    penalty[-1] *= FREE

    def loss(flat: Floats) -> tuple[float, Floats]:
        weights = flat.reshape(wanted.shape[1], -1)
        scores = held @ weights.T
        scores -= scores.max(axis=1, keepdims=True)
        likely = np.exp(scores)
        likely /= likely.sum(axis=1, keepdims=True)
        value = -np.log((likely * wanted).sum(axis=1)).sum() + 0.5 * (penalty * weights**2).sum()
        return float(value), ((likely - wanted).T @ held + penalty * weights).ravel()

    start = np.zeros(wanted.shape[1] * held.shape[1])
    return np.asarray(minimize(loss, start, jac=True, method="L-BFGS-B").x).reshape(wanted.shape[1], -1)
