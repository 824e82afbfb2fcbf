"""Limits from the readings of healthy hands: the tail of each is fitted, and the limit is a far quantile of it.

A validation has some two hundred sides of limits. They share one allowance for a false alarm, so each side may flag
one healthy hand in tens of thousands, far beyond what a campaign can count. So the tail is carried on by a generalised
Pareto distribution, which is what the excesses over a high threshold tend to whatever the distribution is (Pickands
1975), with its parameters from the first two L-moments of the excesses (Hosking and Wallis 1987).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import genpareto, lmoment

from hil.checks.shared.declaration import Check
from hil.verdict.limits import Limit
from train.limits.resolution import resolution

Floats = NDArray[np.float64]

FALSE_ALARMS = 0.004
"""Probability that a healthy hand fails a whole validation, that the limits are computed for."""
TAIL = 0.15
"""Share of the readings that the tail is fitted to."""
FURTHEST = 0.5
"""How far a limit goes beyond the extreme readings at most, as a part of their range."""
FEWEST = 60
"""Readings that a limit needs. Hands of one firmware, guarded or not, that have fewer share the limit of all firmware;
a check with fewer in all is not judged."""
LEAST_EXCESSES = 8
"""Excesses that the fit of a tail needs; with fewer, the limit is the extreme reading and the resolution."""
WRITTEN = 5e-3
"""Relative resolution of a bound, which is written with three figures."""
ROUNDING = 1e-9
"""Part of the mean excess below which its spread is that of rounding alone."""
SHAPES = (-0.25, 0.1)
"""Bounds of the fitted shape: tails with an end not too near, to slightly heavier than exponential. At -0.5 the end
lies three mean excesses above the threshold, where the extreme readings are already; at -0.25 it lies at five."""


Readings = Mapping[tuple[str, str, str], Floats]
"""(experiment, metric, subject) to the readings (n,) of healthy hands."""


@dataclass(frozen=True)
class Healthy:
    """Healthy hands of one group of firmware."""

    firmware: tuple[str, ...]
    population: Readings
    """Readings whose tails are fitted."""
    guarded: bool = False
    """Whether the driver guards them, so that they are weaker at their stops."""


def computed_limits(checks: Sequence[Check], groups: Sequence[Healthy]) -> tuple[Limit, ...]:
    """Return the limits of the checks whose bounds are not given.

    Args:
        checks: all checks, which share the chance of a false alarm.
        groups: healthy hands.

    Raises:
        ValueError: hands of some firmware have no reading of a check.
    """
    sides = sum({"both": 2}.get(check.side or "", 1) for check in checks)
    found: list[Limit] = []
    for check in checks:
        if check.given:
            continue
        versions = {v for group in groups for v in group.firmware if not check.firmware or v in check.firmware}
        meant = [group for group in groups if versions.intersection(group.firmware)]
        # Each subject of a pool may raise an alarm on its own, so they share the chance.
        chance = FALSE_ALARMS / sides / len(check.subjects)
        free = _limits(check, [group for group in meant if not group.guarded], versions, chance)
        # Firmware `pre` has no torque limit, so its guarded hands are stopped before they can be measured.
        measured = [group for group in meant if group.guarded and _pooled(group.population, check).size]
        weaker = _limits(check, measured, versions, chance)
        together = _together(free, weaker)
        found += [limit for limit in together if limit.readings >= FEWEST]
        found += _shared(check, meant, [limit for limit in together if limit.readings < FEWEST], chance)
    return tuple(found)


def _shared(check: Check, groups: Sequence[Healthy], few: Sequence[Limit], chance: float) -> list[Limit]:
    """Return one limit from hands of all firmware for those that have too few readings, by whether they are guarded."""
    found = []
    for guarded in dict.fromkeys(limit.guarded for limit in few):
        alike = [group for group in groups if guarded is None or group.guarded is guarded]
        values = np.concatenate([_pooled(group.population, check) for group in alike])
        firmware = tuple(version for limit in few if limit.guarded is guarded for version in limit.firmware)
        pool = Healthy(firmware, {(check.experiment, check.metric, check.subjects[0]): values})
        if values.size >= FEWEST:
            found += [replace(limit, guarded=guarded) for limit in _limits(check, [pool], set(firmware), chance)]
    return found


def _limits(check: Check, groups: Sequence[Healthy], versions: set[str], chance: float) -> list[Limit]:
    """Return the limits of a check for the groups of firmware, of hands that are guarded or of others."""
    if not groups:
        return []
    for group in groups:
        if not _pooled(group.population, check).size:
            named = f"{check.experiment} {check.metric}"
            raise ValueError(f"no healthy hand of firmware {group.firmware[-1]} measured {named}; run every experiment")
    deviations = np.concatenate([_deviations(group, check) for group in groups])
    beyond = upper_bound(deviations, chance), upper_bound(-deviations, chance)
    return [_limit(check, group, tuple(v for v in group.firmware if v in versions), beyond) for group in groups]


def _together(free: Sequence[Limit], weaker: Sequence[Limit]) -> list[Limit]:
    """Return one limit for both where guarded hands read as others do, and one for each where they do not."""
    guarded = {limit.firmware: limit for limit in weaker}
    found = []
    for limit in free:
        other = guarded.get(limit.firmware)
        assert limit.healthy is not None
        if other is None or other.healthy is None:
            found.append(limit)
            continue
        if limit.at_least < other.healthy[0] and other.healthy[1] < limit.at_most:
            low, high = min(limit.healthy[0], other.healthy[0]), max(limit.healthy[1], other.healthy[1])
            # It has to hold both, whose tails are not the same though their readings overlap.
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


def _deviations(group: Healthy, check: Check) -> Floats:
    """Return the readings of a group less their median: what is left is alike in all versions of the firmware."""
    values = _pooled(group.population, check)
    return values - np.median(values) if values.size else values


def _limit(check: Check, group: Healthy, firmware: tuple[str, ...], beyond: tuple[float, float]) -> Limit:
    """Return a limit from a group's median and how far readings of all groups go above and below theirs."""
    values = _pooled(group.population, check)
    held = np.concatenate([values, np.array(check.recorded or ())])
    low, high, median = float(held.min()), float(held.max()), float(np.median(values))
    # Some readings come in steps, of which no tail can be told; healthy hands are bounded, so the limit stays near.
    most = FURTHEST * float(np.ptp(values))
    step = max(resolution(check, firmware), WRITTEN * max(abs(low), abs(high)))
    upper = max(min(median + beyond[0], float(values.max()) + most), high + step)
    lower = min(max(median - beyond[1], float(values.min()) - most), low - step)
    return Limit(
        check.experiment,
        check.metric,
        check.subjects,
        at_least=-math.inf if check.side == "above" else _outward(lower, -1),
        at_most=math.inf if check.side == "below" else _outward(upper, 1),
        firmware=firmware,
        healthy=(float(f"{low:.6g}"), float(f"{high:.6g}")),
        readings=values.size,
    )


def upper_bound(values: Floats, chance: float) -> float:
    """Return what a reading exceeds with a probability of `chance`, by the tail of `values` (n,)."""
    threshold = float(np.quantile(values, 1.0 - TAIL))
    excesses = values[values > threshold] - threshold
    if excesses.size < LEAST_EXCESSES:
        return float(values.max())
    mean, spread = map(float, lmoment(excesses, order=(1, 2)))
    if spread <= ROUNDING * mean:  # equal but for rounding
        return float(values.max())
    shape = float(np.clip(2.0 - mean / spread, *SHAPES))
    return threshold + float(genpareto.isf(chance / TAIL, shape, scale=mean * (1.0 - shape)))


def _pooled(readings: Readings, check: Check) -> Floats:
    parts = [readings.get((check.experiment, check.metric, subject), np.empty(0)) for subject in check.subjects]
    values = np.concatenate(parts)
    return values[np.isfinite(values)]


def _outward(value: float, sign: int) -> float:
    """Round to three figures, away from the healthy readings."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
    return float(f"{unit * (math.ceil if sign > 0 else math.floor)(value / unit):.6g}")
