"""Drift of a reading towards its limit, by a robust slope over the dates of the runs.

The slope is Theil-Sen's, the median over all pairs of runs, which is robust to a single bad run. A drift is reported
only if Kendall's test rejects independence of reading and date, and the trend reaches a limit within `HORIZON_DAYS`.
All trends of one hand share one false-alarm probability, over a history that is read after every run.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from scipy.stats import kendalltau, theilslopes

from hil.checks import JUDGED
from hil.checks.shared.declaration import Metric
from hil.history.runs import HandRun
from hil.verdict.limits import Limit, load_limits

LEAST_RUNS = 5
"""Threshold of number of runs; below it no drift is reported, because four points often align by chance."""
FALSE_ALARMS = 0.01
"""Bound of the probability that an unchanged hand has any drift, over a history that is read after each of 100 runs.

Each trend has an equal fraction of it, and each reading of n runs a further 1/n. The exact probability of a first
false alarm under Kendall's distribution is then 0.4 of the bound by run 20 and 0.8 by run 100.
"""
RECENT_RUNS = 100
"""Number of latest readings in a trend. Theil-Sen's cost grows with the square of the number."""
CONFIDENCE = 0.95
"""Confidence level of a slope's interval."""
HORIZON_DAYS = 365.0
"""Threshold of time to the limit, days; above it no drift is reported. Chosen as an owner's planning horizon."""
DAYS_A_MONTH = 30.44


@dataclass(frozen=True)
class Track:
    """Readings of one metric on one subject over the runs of a hand."""

    metric: Metric
    experiment: str
    subject: str
    dates: tuple[datetime, ...]
    values: tuple[float, ...]
    since: int = 0
    """Index of the first reading after the last intervention on the subject."""
    limit: Limit | None = None
    """Limit of the hand's present firmware."""


@dataclass(frozen=True)
class Drift:
    """Drift of a reading towards a limit."""

    track: Track
    per_month: float
    """Slope, in the metric's unit a month."""
    interval: tuple[float, float]
    """95 % interval of the slope."""
    bound: float
    """Approached limit, in the metric's unit."""
    days_left: float
    """Days from the last run until the trend passes the limit; 0 if it has passed."""

    @property
    def sentence(self) -> str:
        """Description in one line, for display."""
        unit, subject = self.track.metric.unit, self.track.subject.replace("_", " ")
        low, high = self.interval
        slope = f"{subject}: {self.track.metric.words} {self.per_month:+.3g} {unit} a month ({low:+.3g} to {high:+.3g})"
        if self.days_left <= 0.0:
            return f"{slope}, past its limit of {self.bound:g} {unit}"
        months = self.days_left / DAYS_A_MONTH
        left = f"{months:.0f} months" if months >= 2.0 else f"{self.days_left:.0f} days"
        return f"{slope}, limit of {self.bound:g} {unit} in about {left}"


def tracks_of(runs: Sequence[HandRun]) -> list[Track]:
    """Return the readings of every judged metric and subject by date, those with a trend of their own first.

    Args:
        runs: runs of one hand in order of date.
    """
    if not runs:
        return []
    last = runs[-1].header
    limits = {
        (limit.experiment, limit.metric, subject): limit
        for limit in load_limits(last.firmware, guarded=bool(last.safety))
        for subject in limit.subjects
    }
    found: list[Track] = []
    for experiment, measuring in JUDGED.items():
        for metric in measuring.metrics:
            for subject in metric.subjects:
                limit = limits.get((experiment, metric.name, subject))
                found += _track(metric, experiment, subject, runs, limit)
    return sorted(found, key=lambda track: track.metric.trend or math.inf)


def _track(
    metric: Metric, experiment: str, subject: str, runs: Sequence[HandRun], limit: Limit | None
) -> Iterator[Track]:
    dates: list[datetime] = []
    values: list[float] = []
    since, boundary = 0, False
    for run in runs:
        value = run.measured.get(experiment, {}).get(subject, {}).get(metric.name)
        if value is not None and math.isfinite(float(value)):
            if boundary:
                since, boundary = len(values), False
            dates.append(run.started)
            values.append(float(value))
        # Interventions of a case follow the run that opened it.
        boundary |= any(done.concerns(subject) for done in run.interventions)
    if values:
        since = len(values) if boundary else since
        yield Track(metric, experiment, subject, tuple(dates), tuple(values), since, limit)


def drifts_of(tracks: Iterable[Track]) -> list[Drift]:
    """Return the drifts, the nearest limit first."""
    every = [track for track in tracks if track.limit is not None]
    chance = FALSE_ALARMS / max(1, len(every))
    found = [drift for track in every if (drift := _drift(track, chance)) is not None]
    return sorted(found, key=lambda drift: drift.days_left)


def _drift(track: Track, chance: float) -> Drift | None:
    since = max(track.since, len(track.values) - RECENT_RUNS)
    values = np.array(track.values[since:])
    if len(values) < LEAST_RUNS or track.limit is None:
        return None
    begin = track.dates[since]
    days = np.array([(date - begin).total_seconds() / 86400.0 for date in track.dates[since:]])
    if np.ptp(days) <= 0.0:
        return None
    slope, _, low, high = theilslopes(values, days, alpha=CONFIDENCE)
    # Ranked against the trend, equal readings leave SciPy's exact distribution and can only raise the probability.
    ranks = np.argsort(np.lexsort((-days, np.sign(slope) * values)))
    # Not by the slope's interval, which for five runs ends at the steepest pair at any confidence level.
    if slope == 0.0 or kendalltau(days, ranks).pvalue > chance / len(values):
        return None
    # SciPy's line goes through the medians of days and values, which a trend makes uncertain.
    intercept = np.median(values - slope * days)
    bound = track.limit.at_most if slope > 0.0 else track.limit.at_least
    if not math.isfinite(bound):
        return None
    left = max(0.0, float((bound - (intercept + slope * days[-1])) / slope))
    if left > HORIZON_DAYS:
        return None
    month = DAYS_A_MONTH
    return Drift(track, float(slope) * month, (float(low) * month, float(high) * month), bound, left)
