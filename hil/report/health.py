"""Health of each channel at a glance: main readings, each on the range of its limits."""

import math
from dataclasses import dataclass

from hil.checks import JUDGED
from hil.checks.shared.subjects import SUBJECTS, subject_words
from hil.verdict.judged_run import Validation
from hil.verdict.limits import Limit, load_limits

BAND = (0.2, 0.8)
"""Fractions of a strip's width at which a range with two limits begins and ends."""


@dataclass(frozen=True)
class Strip:
    """Reading on the range of its limits; abscissas are fractions of the width, 0 to 1."""

    value: str
    """Reading with its unit."""
    limits: str
    band: tuple[float, float]
    at: float | None
    """Abscissa of the reading, clipped to the strip; None if it is not measurable."""
    outside: bool


@dataclass(frozen=True)
class ChannelHealth:
    """Table of strips: a row for each channel."""

    titles: tuple[str, ...]
    rows: tuple[tuple[str, tuple[Strip | None, ...]], ...]


def health_of(validation: Validation) -> ChannelHealth:
    """Return the main readings of a run by channel: metrics with a `trend`, in its order."""
    header = validation.header
    strips: dict[str, dict[int, Strip]] = {}
    titles: dict[int, str] = {}
    limits = load_limits(header.firmware, guarded=bool(header.safety)) if header is not None else ()
    for limit in limits:
        result = validation.judged.get(limit.experiment)
        if result is None:
            continue
        for metric in JUDGED[limit.experiment].metrics:
            if metric.name != limit.metric or not metric.trend:
                continue
            withheld = {one.subject for one in result.withheld if one.metric == metric.name}
            for subject in {*limit.subjects} & {*metric.subjects}:
                value = result.measured.get(subject, {}).get(metric.name)
                if value is not None and subject not in withheld:
                    titles[metric.trend] = metric.words
                    strips.setdefault(subject, {})[metric.trend] = strip(float(value), limit, metric.unit)
    places = sorted(titles)
    order = [subject for subject in SUBJECTS if subject in strips]
    return ChannelHealth(
        tuple(titles[place] for place in places),
        tuple((subject_words(subject), tuple(strips[subject].get(place) for place in places)) for subject in order),
    )


def strip(value: float, limit: Limit, unit: str) -> Strip:
    """Return a reading on the range of a limit; a range with one limit fills the strip towards its open side."""
    low, high = limit.at_least, limit.at_most
    if math.isfinite(low) and math.isfinite(high):
        (begin, end), band = (low, high), BAND
    elif math.isfinite(high):
        (begin, end), band = (min(0.0, high - 1.0), high), (0.0, BAND[1])
    else:
        (begin, end), band = (low, low + max(abs(low), 1.0)), (BAND[0], 1.0)
    if math.isnan(value):
        return Strip("not measurable", limit.text(unit), band, None, outside=False)
    at = band[0] + (value - begin) / (end - begin) * (band[1] - band[0])
    outside = not low <= value <= high
    return Strip(f"{value:.3g} {unit}", limit.text(unit), band, min(max(at, 0.0), 1.0), outside)
