"""Limits from the readings of healthy hands: a far quantile of a fitted tail.

A validation has some two hundred limit sides with a shared false-alarm allowance, so each side may flag one healthy
hand in tens of thousands, far beyond any countable campaign. The tail is therefore extrapolated with a generalised
Pareto distribution, the limit distribution of excesses over a high threshold (Pickands 1975). Its parameters are fitted
from the first two L-moments of the excesses (Hosking and Wallis 1987).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import genpareto, lmoment

from aero.floats import Floats
from hil.checks.shared.declaration import Bound
from hil.verdict.limits import Limit
from train.limits.resolution import resolution

FALSE_ALARMS = 0.004
"""Design probability that a healthy hand fails a whole validation."""
TAIL = 0.15
"""Fraction of the readings used to fit the tail."""
FURTHEST = 0.5
"""Largest extrapolation of a limit beyond the extreme readings, as a fraction of their range."""
FEWEST = 60
"""Smallest number of readings for a limit.

Hands of one firmware, guarded or not, with fewer readings share the limit of all firmware; a bound with fewer readings
in all is not judged.
"""
LEAST_EXCESSES = 8
"""Smallest number of excesses for a tail fit; below it the limit is the extreme reading plus the resolution."""
WRITTEN = 5e-3
"""Relative resolution of a bound, which is rounded to three figures."""
ROUNDING = 1e-9
"""Threshold of the spread over the mean excess, dimensionless; below it the spread is only rounding."""
SHAPES = (-0.25, 0.1)
"""Bounds of the fitted shape: from bounded tails to slightly heavier than exponential.

At -0.5 the tail ends three mean excesses above the threshold, where the extreme readings already are; at -0.25 it ends
at five.
"""


Readings = Mapping[tuple[str, str, str], Floats]
"""Readings (n,) of healthy hands by (experiment, metric, subject)."""


@dataclass(frozen=True)
class Healthy:
    """Healthy hands of one firmware group."""

    firmware: tuple[str, ...]
    population: Readings
    """Readings for the tail fit."""
    guarded: bool = False
    """Whether these hands are guarded; a guard limits the force at their stops."""


def computed_limits(bounds: Sequence[Bound], groups: Sequence[Healthy]) -> tuple[Limit, ...]:
    """Return the limits of the bounds that are not fixed.

    Args:
        bounds: all bounds, which share the chance of a false alarm.
        groups: healthy hands.

    Raises:
        ValueError: hands of some firmware have no reading of a bound.
    """
    sides = sum({"both": 2}.get(bound.side or "", 1) for bound in bounds)
    found: list[Limit] = []
    for bound in bounds:
        if bound.given:
            continue
        versions = {v for group in groups for v in group.firmware if not bound.firmware or v in bound.firmware}
        meant = [group for group in groups if versions.intersection(group.firmware)]
        # Each subject of a pool can raise a false alarm alone, so all subjects share the allowance.
        chance = FALSE_ALARMS / sides / len(bound.subjects)
        free = _limits(bound, [group for group in meant if not group.guarded], versions, chance)
        # Firmware `pre` has no torque limit, so the guard stops its hands before a measurement.
        measured = [group for group in meant if group.guarded and _pooled(group.population, bound).size]
        weaker = _limits(bound, measured, versions, chance)
        together = _together(free, weaker)
        found += [limit for limit in together if limit.readings >= FEWEST]
        found += _shared(bound, meant, [limit for limit in together if limit.readings < FEWEST], chance)
    return tuple(found)


def _shared(bound: Bound, groups: Sequence[Healthy], few: Sequence[Limit], chance: float) -> list[Limit]:
    """Return pooled limits over all firmware, by guard state, for bounds with too few readings per firmware."""
    found = []
    for guarded in dict.fromkeys(limit.guarded for limit in few):
        alike = [group for group in groups if guarded is None or group.guarded is guarded]
        values = np.concatenate([_pooled(group.population, bound) for group in alike])
        firmware = tuple(version for limit in few if limit.guarded is guarded for version in limit.firmware)
        pool = Healthy(firmware, {(bound.experiment, bound.metric, bound.subjects[0]): values})
        if values.size >= FEWEST:
            found += [replace(limit, guarded=guarded) for limit in _limits(bound, [pool], set(firmware), chance)]
    return found


def _limits(bound: Bound, groups: Sequence[Healthy], versions: set[str], chance: float) -> list[Limit]:
    """Return the limits of a bound per firmware group, for either guarded or unguarded hands."""
    if not groups:
        return []
    for group in groups:
        if not _pooled(group.population, bound).size:
            named = f"{bound.experiment} {bound.metric}"
            raise ValueError(f"no healthy hand of firmware {group.firmware[-1]} measured {named}; run every experiment")
    deviations = np.concatenate([_deviations(group, bound) for group in groups])
    beyond = upper_bound(deviations, chance), upper_bound(-deviations, chance)
    return [_limit(bound, group, tuple(v for v in group.firmware if v in versions), beyond) for group in groups]


def _together(free: Sequence[Limit], weaker: Sequence[Limit]) -> list[Limit]:
    """Return a common limit if guarded and unguarded hands have similar or few readings, else two limits."""
    guarded = {limit.firmware: limit for limit in weaker}
    found = []
    for limit in free:
        other = guarded.get(limit.firmware)
        assert limit.healthy is not None
        if other is None or other.healthy is None:
            found.append(limit)
            continue
        alike = limit.at_least < other.healthy[0] and other.healthy[1] < limit.at_most
        # Hands of another firmware differ by more than a guard makes.
        if alike or min(limit.readings, other.readings) < FEWEST:
            low, high = min(limit.healthy[0], other.healthy[0]), max(limit.healthy[1], other.healthy[1])
            # The common limit covers both tails, which differ even where the readings overlap.
            found.append(
                replace(
                    limit,
                    healthy=(low, high),
                    at_least=min(limit.at_least, other.at_least),
                    at_most=max(limit.at_most, other.at_most),
                    readings=limit.readings + other.readings,
                )
            )
        else:
            found += [replace(limit, guarded=False), replace(other, guarded=True)]
    return found


def _deviations(group: Healthy, bound: Bound) -> Floats:
    """Return a group's readings minus their median; the residuals are alike for all firmware versions."""
    values = _pooled(group.population, bound)
    return values - np.median(values) if values.size else values


def _limit(bound: Bound, group: Healthy, firmware: tuple[str, ...], beyond: tuple[float, float]) -> Limit:
    """Return a limit from a group's median and the pooled upper and lower tail bounds `beyond`."""
    values = _pooled(group.population, bound)
    held = np.concatenate([values, np.array(bound.recorded or ())])
    low, high, median = float(held.min()), float(held.max()), float(np.median(values))
    # Quantised readings have no tail to fit; healthy hands are bounded, so the limit stays close.
    most = FURTHEST * float(np.ptp(values))
    step = max(resolution(bound, firmware), WRITTEN * max(abs(low), abs(high)))
    upper = max(min(median + beyond[0], float(values.max()) + most), high + step)
    lower = min(max(median - beyond[1], float(values.min()) - most), low - step)
    return Limit(
        bound.experiment,
        bound.metric,
        bound.subjects,
        at_least=-math.inf if bound.side == "above" else _outward(lower, -1),
        at_most=math.inf if bound.side == "below" else _outward(upper, 1),
        firmware=firmware,
        healthy=(float(f"{low:.6g}"), float(f"{high:.6g}")),
        readings=values.size,
    )


def upper_bound(values: Floats, chance: float) -> float:
    """Return the reading that is exceeded with probability `chance`, from the tail of `values` (n,)."""
    threshold = float(np.quantile(values, 1.0 - TAIL))
    excesses = values[values > threshold] - threshold
    if excesses.size < LEAST_EXCESSES:
        return float(values.max())
    mean, spread = map(float, lmoment(excesses, order=(1, 2)))
    if spread <= ROUNDING * mean:  # equal up to rounding
        return float(values.max())
    shape = float(np.clip(2.0 - mean / spread, *SHAPES))
    return threshold + float(genpareto.isf(chance / TAIL, shape, scale=mean * (1.0 - shape)))


def _pooled(readings: Readings, bound: Bound) -> Floats:
    parts = [readings.get((bound.experiment, bound.metric, subject), np.empty(0)) for subject in bound.subjects]
    values = np.concatenate(parts)
    return values[np.isfinite(values)]


def _outward(value: float, sign: int) -> float:
    """Round to three figures, away from the healthy readings."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
    return float(f"{unit * (math.ceil if sign > 0 else math.floor)(value / unit):.6g}")
