"""What a set of trials came to, with intervals of 95 %."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import binomtest, bootstrap

CONFIDENCE = 0.95
LEAST = 3
"""Trials below which no interval of a mean is given."""
TURNS_RAD_S = 0.1
"""Rate from which a trial counts as one that turns the cube: a turn takes a minute."""
BOOTSTRAP_SEED = 0
"""The same trials give the same interval."""

Interval = tuple[float, float]
Floats = NDArray[np.float64]


class HeldCube(Protocol):
    """What is counted of a trial."""

    @property
    def kept(self) -> bool:
        """Whether the cube was still in the hand at the end."""

    @property
    def alive_s(self) -> float:
        """Time until then or until the loss, s."""

    @property
    def rotation_rad(self) -> float:
        """Rotation in that time, rad."""


@dataclass(frozen=True)
class TrialSet:
    """What a set of trials came to."""

    name: str
    trials: int
    kept: int
    """Trials at whose end the cube was still in the hand."""
    kept_interval: Interval
    """Wilson's interval of the share that kept it."""
    rate_rad_s: float
    """Rotation of all trials over the time in which they held the cube; a trial that drops it early counts for little.
    NaN without trials."""
    rate_interval: Interval
    """Bootstrapped; NaN with fewer than `LEAST` trials."""
    turned_rad: float
    """Median rotation until the end or the loss."""
    turning: float
    """Share of the trials above `TURNS_RAD_S`."""
    turning_interval: Interval
    """Wilson's."""

    @property
    def kept_share(self) -> float:
        """Share of the trials that kept the cube; NaN without trials."""
        return self.kept / self.trials if self.trials else np.nan


def trial_set_of(name: str, trials: Sequence[HeldCube]) -> TrialSet:
    """Return what `trials` came to."""
    columns = [(one.kept, one.alive_s, one.rotation_rad) for one in trials]
    return trial_set(name, *np.array(columns, float).reshape(-1, 3).T)


def trial_set(name: str, kept: ArrayLike, alive_s: ArrayLike, rotation_rad: ArrayLike) -> TrialSet:
    """Return what trials came to; the arrays are (trials,)."""
    kept, alive, rotation = np.asarray(kept, bool), np.asarray(alive_s, float), np.asarray(rotation_rad, float)
    turning = rates(alive, rotation) > TURNS_RAD_S
    return TrialSet(
        name=name,
        trials=len(kept),
        kept=int(kept.sum()),
        kept_interval=share_interval(int(kept.sum()), len(kept)),
        rate_rad_s=float(_rate(rotation, alive)) if len(kept) else np.nan,
        rate_interval=_rate_interval(rotation, alive),
        turned_rad=float(np.median(rotation)) if len(kept) else np.nan,
        turning=float(turning.mean()) if len(kept) else np.nan,
        turning_interval=share_interval(int(turning.sum()), len(kept)),
    )


def rates(alive_s: Floats, rotation_rad: Floats) -> Floats:
    """Return the rate of each trial (trials,), rad/s; zero where the cube was never held."""
    return np.divide(rotation_rad, alive_s, out=np.zeros(len(alive_s)), where=alive_s > 0)


def share_interval(count: int, of: int) -> Interval:
    """Return Wilson's interval of a share; all that is possible without trials."""
    if not of:
        return (0.0, 1.0)
    found = binomtest(count, of).proportion_ci(CONFIDENCE, method="wilson")
    return (float(found.low), float(found.high))


def _rate(rotation: Floats, alive: Floats, axis: int = -1) -> Any:
    return rotation.sum(axis) / np.maximum(alive.sum(axis), np.finfo(float).tiny)


def _rate_interval(rotation: Floats, alive: Floats) -> Interval:
    return _bootstrapped((rotation, alive), _rate, rates(alive, rotation))


def _bootstrapped(data: tuple[Floats, ...], statistic: Any, each: Floats) -> Interval:
    if len(each) < LEAST:
        return (np.nan, np.nan)
    if np.ptp(each) == 0.0:
        return (float(each[0]), float(each[0]))
    found = bootstrap(data, statistic, confidence_level=CONFIDENCE, paired=len(data) > 1, rng=BOOTSTRAP_SEED)
    return (float(found.confidence_interval.low), float(found.confidence_interval.high))
