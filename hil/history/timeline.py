"""History page of a hand: drifts, a row of sparklines for each channel, and every run with its commit and steps."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from itertools import groupby

import jinja2

from hil.checks.shared.subjects import subject_words
from hil.history.drift import LEAST_RUNS, Drift, Track
from hil.history.runs import HandRun, RunVerdict

WIDTH, HEIGHT, MARGIN = 150.0, 40.0, 4.0
"""Size of a sparkline and its margin, units of its view box."""
MAX_POINTS = 150
"""Maximum number of points of a curve, one a unit of its width."""


@dataclass(frozen=True)
class Sparkline:
    """Readings of a track over the dates of a hand, in units of the view box, y downwards."""

    points: tuple[tuple[float, float], ...]
    band: tuple[float, float]
    """Top and bottom of the permitted range."""
    repairs: tuple[float, ...]
    """Abscissas of the steps of a case on the subject."""


@dataclass(frozen=True)
class Trend:
    """One metric of one subject in the page."""

    title: str
    last: str
    """Last reading with its unit."""
    change: str
    """Last less first reading in the same unit, with sign; empty for a single reading."""
    limits: str
    outside: bool
    """Whether the last reading is outside its limits."""
    sparkline: Sparkline


@dataclass(frozen=True)
class ChannelTrends:
    """Readings of one subject."""

    subject: str
    cells: tuple[Trend | None, ...]
    """One for each title of the table; None without a reading."""

    def titled(self, titles: Sequence[str]) -> list[tuple[str, Trend | None]]:
        """Return the cells with the titles of their columns."""
        return list(zip(titles, self.cells, strict=True))


@dataclass(frozen=True)
class Trends:
    """Table of the metrics of which each channel has a trend."""

    titles: tuple[str, ...]
    rows: tuple[ChannelTrends, ...]


def render_history(hand: str, runs: Sequence[HandRun], tracks: Sequence[Track], drifts: Sequence[Drift]) -> str:
    """Return the page of a hand that has at least one run."""
    dates = (runs[0].started, runs[-1].started)
    judged = [track for track in tracks if track.limit is not None]
    further = [track for track in judged if not track.metric.trend]
    return _template().render(
        hand=hand,
        runs=runs,
        drifts=[drift.sentence for drift in drifts],
        no_drift=no_drift(tracks),
        trends=trends_of(tracks, runs),
        further=[
            (experiment, [(subject_words(track.subject), _cell(track, dates, runs)) for track in group])
            for experiment, group in groupby(further, key=lambda track: track.experiment)
        ],
        not_judged=sum(run.verdict is RunVerdict.NOT_JUDGED for run in runs),
        size=(WIDTH, HEIGHT),
    )


def no_drift(tracks: Sequence[Track]) -> str:
    """Return the sentence for a history without a drift: none found, or too few runs to tell."""
    tracks = [track for track in tracks if track.limit is not None]
    enough = sum(len(track.values) - track.since >= LEAST_RUNS for track in tracks)
    if not enough:
        return f"Not known: a drift needs {LEAST_RUNS} runs after the last repair of a channel."
    if enough < len(tracks):
        return (
            f"No drift towards a limit within a year in {enough} of {len(tracks)} readings; the others have fewer than "
            f"{LEAST_RUNS} runs after the last repair."
        )
    return "No drift towards a limit within a year."


def trends_of(tracks: Sequence[Track], runs: Sequence[HandRun]) -> Trends:
    """Return a row for each subject and a column for each metric with a trend, limits and readings.

    Of two experiments that measure one metric, the one with more readings is shown.
    """
    dates = (runs[0].started, runs[-1].started)
    tracks = [track for track in tracks if track.metric.trend and track.limit is not None]
    columns = {(track.metric.trend, track.metric.name): track.metric.words for track in tracks}
    best: dict[tuple[str, tuple[int, str]], Track] = {}
    for track in sorted(tracks, key=lambda track: len(track.values)):
        best[track.subject, (track.metric.trend, track.metric.name)] = track
    places = sorted(columns)
    rows = []
    for subject in dict.fromkeys(track.subject for track in tracks):
        found = [best.get((subject, place)) for place in places]
        cells = (None if track is None else _cell(track, dates, runs) for track in found)
        rows.append(ChannelTrends(subject_words(subject), tuple(cells)))
    return Trends(tuple(columns[place] for place in places), tuple(rows))


def _cell(track: Track, dates: tuple[datetime, datetime], runs: Sequence[HandRun]) -> Trend:
    assert track.limit is not None
    last = track.values[-1]
    repairs = [run.started for run in runs if any(step.concerns(track.subject) for step in run.interventions)]
    return Trend(
        title=track.metric.words,
        last=f"{last:.3g} {track.metric.unit}",
        change=_change(last - track.values[0]) if len(track.values) > 1 else "",
        limits=track.limit.text(track.metric.unit),
        outside=not track.limit.at_least <= last <= track.limit.at_most,
        sparkline=sparkline(track, dates, repairs),
    )


def _change(change: float) -> str:
    text = f"{change:+.2g}"
    return "±0" if float(text) == 0.0 else text


def sparkline(track: Track, dates: tuple[datetime, datetime], repairs: Sequence[datetime] = ()) -> Sparkline:
    """Return the curve of a track between the first and last date of its hand.

    The ordinate covers readings and finite limits; the band is open towards an infinite limit.
    """
    assert track.limit is not None
    bounds = [bound for bound in (track.limit.at_least, track.limit.at_most) if math.isfinite(bound)]
    low, high = min(*track.values, *bounds), max(*track.values, *bounds)
    if low == high:
        low, high = low - 1.0, high + 1.0

    def x(date: datetime) -> float:
        span = (dates[1] - dates[0]).total_seconds()
        part = (date - dates[0]).total_seconds() / span if span > 0.0 else 0.5
        return round(MARGIN + part * (WIDTH - 2 * MARGIN), 1)

    def y(value: float) -> float:
        part = (min(max(value, low), high) - low) / (high - low)
        return round(HEIGHT - MARGIN - part * (HEIGHT - 2 * MARGIN), 1)

    top = y(track.limit.at_most) if math.isfinite(track.limit.at_most) else 0.0
    bottom = y(track.limit.at_least) if math.isfinite(track.limit.at_least) else HEIGHT
    stride = -(-len(track.values) // MAX_POINTS)
    drawn = zip(track.dates[::-stride], track.values[::-stride], strict=True)  # from the last reading backwards
    points = tuple((x(date), y(value)) for date, value in drawn)[::-1]
    return Sparkline(points, (top, bottom), tuple(x(date) for date in repairs))


@cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("hil.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template("history.html.j2")
