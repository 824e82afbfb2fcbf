"""History page of a hand: drifts, charts (regression metrics first), and every run with its commit and steps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache

import jinja2
import matplotlib.dates as mdates
from matplotlib.figure import Figure

from hil.history.drift import Drift, Track
from hil.history.runs import HandRun
from hil.report.matplotlib_svg import svg_of

COLUMNS, WIDTH_IN, HEIGHT_IN = 4, 2.7, 1.8
"""Panels a row, and width and height of a panel, inches."""


def render_history(hand: str, runs: Sequence[HandRun], tracks: Sequence[Track], drifts: Sequence[Drift]) -> str:
    """Return the page of a hand that has at least one run."""
    return _template().render(
        hand=hand,
        runs=runs,
        drifts=[drift.sentence for drift in drifts],
        charts=[(title, svg_of(_chart(group, runs))) for title, group in _groups(tracks)],
    )


@cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("hil.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template("history.html.j2")


def _groups(tracks: Sequence[Track]) -> Iterator[tuple[str, list[Track]]]:
    """Yield title and readings by subject of each metric with a limit."""
    found: dict[tuple[str, str], list[Track]] = {}
    for track in tracks:
        if track.limit is not None:
            found.setdefault((track.experiment, track.metric.words), []).append(track)
    for (experiment, words), group in found.items():
        yield f"{words} ({experiment}), {group[0].metric.unit}", group


def _chart(group: Sequence[Track], runs: Sequence[HandRun]) -> Figure:
    rows = -(-len(group) // COLUMNS)
    figure = Figure(figsize=(WIDTH_IN * min(COLUMNS, len(group)), HEIGHT_IN * rows), layout="constrained")
    panels = figure.subplots(rows, min(COLUMNS, len(group)), squeeze=False, sharex=True).flat
    for panel, track in zip(panels, group, strict=False):
        panel.plot(track.dates, track.values, "o-", markersize=3, color="#1f5fa8")
        assert track.limit is not None
        for bound in (track.limit.at_least, track.limit.at_most):
            if math.isfinite(bound):
                panel.axhline(bound, color="#b3261e", linewidth=0.8)
        for run in runs:
            if any(not step.channels or track.subject in step.channels for step in run.interventions):
                panel.axvline(run.started, color="#777777", linestyle=":", linewidth=1.0)
        panel.set_title(track.subject.replace("_", " "), fontsize=9, loc="left")
        locator = mdates.AutoDateLocator(maxticks=4)  # type: ignore[no-untyped-call]  # matplotlib leaves both
        panel.xaxis.set_major_locator(locator)
        panel.xaxis.set_major_formatter(mdates.ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
    for panel in list(panels):
        panel.set_visible(False)
    return figure
