"""Drift of a reading towards its limit, by a robust slope over the dates of the runs.

The slope is Theil and Sen's, the median of the slopes between all pairs of runs, so that a single bad run moves it
little. A drift is reported only if Kendall's test rejects independence of the date, the slope leads to a limit, and the
limit is less than `HORIZON_DAYS` away. All trends of one hand share one chance of a false alarm.
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
"""Runs below which nothing is reported: four points lie on a line too often."""
FALSE_ALARMS = 0.004
"""Probability of reporting any drift of a hand that does not change. Source: that of a validation's limits."""
CONFIDENCE = 0.95
"""Of the interval that is printed beside a slope."""
HORIZON_DAYS = 365.0
"""Time to the limit beyond which a drift is not reported. Chosen: an owner plans no further."""
DAYS_A_MONTH = 30.44
FIRST = ("rise_hand_ms", "tracking_rms")
"""Metrics that are listed first: the regression that every run is compared by."""


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
    """A reading that moves towards a limit."""

    track: Track
    per_month: float
    """Slope, in the metric's unit a month."""
    interval: tuple[float, float]
    """95 % interval of the slope."""
    bound: float
    """Limit that the reading approaches."""
    days_left: float
    """Days from the last run until the trend passes the limit; 0 if it has passed."""

    @property
    def sentence(self) -> str:
        """Text for people, in one line."""
        unit, subject = self.track.metric.unit, self.track.subject.replace("_", " ")
        low, high = self.interval
        slope = f"{subject}: {self.track.metric.words} {self.per_month:+.3g} {unit} a month ({low:+.3g} to {high:+.3g})"
        if self.days_left <= 0.0:
            return f"{slope}, past its limit of {self.bound:g} {unit}"
        months = self.days_left / DAYS_A_MONTH
        left = f"{months:.0f} months" if months >= 2.0 else f"{self.days_left:.0f} days"
        return f"{slope}, limit of {self.bound:g} {unit} in about {left}"


def tracks_of(runs: Sequence[HandRun]) -> list[Track]:
    """Return the readings of every judged metric and subject by date, the regression's metrics first.

    Args:
        runs: of one hand, in the order of their dates.
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
    return sorted(found, key=lambda track: (track.metric.name not in FIRST, track.metric.name != FIRST[0]))


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
        # What a person did in a case comes after the run that opened it.
        boundary |= any(not done.channels or subject in done.channels for done in run.interventions)
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
    values = np.array(track.values[track.since :])
    if len(values) < LEAST_RUNS or track.limit is None:
        return None
    begin = track.dates[track.since]
    days = np.array([(date - begin).total_seconds() / 86400.0 for date in track.dates[track.since :]])
    if np.ptp(days) <= 0.0 or np.ptp(values) <= 0.0:
        return None
    # Not by the interval of the slope: of five runs it ends at the steepest pair, whatever its confidence.
    if not kendalltau(days, values).pvalue <= chance:
        return None
    slope, intercept, low, high = theilslopes(values, days, alpha=CONFIDENCE)
    bound = track.limit.at_most if slope > 0.0 else track.limit.at_least
    if not math.isfinite(bound):
        return None
    left = max(0.0, float((bound - (intercept + slope * days[-1])) / slope))
    if left > HORIZON_DAYS:
        return None
    month = DAYS_A_MONTH
    return Drift(track, float(slope) * month, (float(low) * month, float(high) * month), bound, left)
