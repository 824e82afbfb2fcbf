"""The page that a campaign ends with."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from hil.lab.campaign.summary import Detection, detections, false_alarms, judged
from hil.lab.campaign.trial import Outcome
from hil.report.matplotlib_svg import svg_of

LISTED = 10
"""Rows of the slowest and the strangest."""
CURVES_A_ROW = 7


def render_campaign(outcomes: Sequence[Outcome]) -> str:
    """Return the page about a campaign; it loads nothing from anywhere."""
    healthy = [outcome for outcome in outcomes if not outcome.trial.faults]
    alarms, by_check = false_alarms(outcomes) if healthy else (None, {})
    rows = detections(outcomes)
    found = sum(row.found.count for row in rows)
    wall, hand = sum(o.wall_s for o in outcomes), sum(o.hand_s for o in outcomes)
    facts = f"{hand / 3600:.1f} hours of hand time in {wall / 3600:.2f} hours of work."
    if found:
        facts += (
            f" Of {sum(row.found.of for row in rows)} faulty hands {found} were found: the right place of "
            f"{sum(row.located for row in rows)} was told, and the right cause of {sum(row.explained for row in rows)}."
        )
    environment = Environment(
        loader=PackageLoader("hil.lab.campaign"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    return environment.get_template("campaign.html.j2").render(
        runs=len(outcomes),
        facts=facts,
        alarms="" if alarms is None else str(alarms),
        by_check=sorted(by_check.items(), key=lambda item: -item[1]),
        rows=rows,
        matrix=svg_of(_matrix(rows)) if rows else "",
        curves=svg_of(_curves(rows)) if rows else "",
        slowest=[(o.trial.key, o.wall_s) for o in sorted(outcomes, key=lambda o: -o.wall_s)[:LISTED]],
        strangest=_strangest(healthy),
    )


def _strangest(healthy: Sequence[Outcome]) -> list[tuple[str, str, float]]:
    furthest = []
    for outcome in healthy:
        if found := judged(outcome):
            key = max(found, key=lambda name: abs(found[name]))
            furthest.append((outcome.trial.key, "/".join(key), abs(found[key])))
    return sorted(furthest, key=lambda row: -row[2])[:LISTED]


def _matrix(rows: Sequence[Detection]) -> Figure:
    """Draw which check fails under which fault."""
    faults = list(dict.fromkeys(row.name for row in rows))
    checks = sorted({check for row in rows for check, _ in row.checks})
    shares, tried = np.zeros((len(faults), len(checks))), np.zeros((len(faults), 1))
    for row in rows:
        tried[faults.index(row.name)] += row.found.of
        for check, count in row.checks:
            shares[faults.index(row.name), checks.index(check)] += count
    figure = Figure(figsize=(4 + 0.24 * len(checks), 2.5 + 0.2 * len(faults)), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(shares / tried, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    axes.set_xticks(range(len(checks)), checks, rotation=90, fontsize=8)
    axes.set_yticks(range(len(faults)), [name.replace("_", " ") for name in faults], fontsize=8)
    axes.set_xticks(np.arange(-0.5, len(checks)), minor=True)
    axes.set_yticks(np.arange(-0.5, len(faults)), minor=True)
    axes.grid(which="minor", color="#d5dae0", linewidth=0.5)
    axes.tick_params(which="minor", length=0)
    axes.xaxis.tick_top()
    return figure


def _curves(rows: Sequence[Detection]) -> Figure:
    """Draw the share found against the severity, a panel a fault."""
    by_name: dict[str, list[Detection]] = defaultdict(list)
    for row in rows:
        by_name[row.name].append(row)
    graded = {name: some for name, some in by_name.items() if len(some) > 1} or by_name
    lines = -(-len(graded) // CURVES_A_ROW)
    figure = Figure(figsize=(14, 1.7 * lines), layout="constrained")
    panels = figure.subplots(lines, CURVES_A_ROW, squeeze=False, sharey=True)
    for axes in panels.flat[len(graded) :]:
        axes.set_visible(False)
    for axes, (name, some) in zip(panels.flat, graded.items(), strict=False):
        shares = np.array([row.found.value for row in some])
        bounds = np.array([row.found.interval for row in some]).T
        at = np.arange(len(some))
        axes.errorbar(at, shares, np.abs(bounds - shares), marker="o", color="#1c5d99", capsize=2, linewidth=1)
        axes.set_xticks(at, [f"{row.severity:g}" for row in some], fontsize=7)
        axes.set_title(name.replace("_", " "), fontsize=8)
        axes.set_xlabel(some[0].unit, fontsize=7)
        axes.set_ylim(-0.05, 1.05)
        axes.tick_params(axis="y", labelsize=7)
    return figure
