"""What a campaign says about the checks: which hands they flag, from which severity on, and what is said of them."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from hil.checks import ALIKE, Measured
from hil.faults import CATALOGUE, Injection, parse_fault
from hil.report.matplotlib_svg import svg_of
from hil.verdict.diagnosis import Diagnosis
from hil.verdict.judge import Judge
from hil.verdict.limits import Key, excesses, load_limits, within_limits
from hil.verdict.run_end import FINISHED
from hil.verdict.suspects import clues, suspected
from train.campaign.trial import Outcome, written
from train.share import Share

NOT_FIRED = "FaultNeverFiredError"


@dataclass(frozen=True)
class Detection:
    """One fault in one severity on several hands."""

    name: str
    severity: float
    unit: str
    found: Share
    checks: tuple[tuple[str, int], ...]
    """`experiment/metric` and in how many hands it failed, the most first."""
    located: int
    """Hands, of those found, that suspect the part at fault first."""
    furthest: float
    """Of the hands that were not found, the largest part of the way from healthy readings to a limit, 0 to 1."""


def flagged(outcome: Outcome) -> bool:
    """Return whether the present limits flag the hand of a trial."""
    return bool(outcome.stopped) or not all(map(within_limits, judged(outcome).values()))


def judged(outcome: Outcome) -> dict[Key, float | None]:
    """Return the excesses of a trial by the present limits of its hand."""
    trial = outcome.trial
    limits = load_limits(trial.firmware, guarded=trial.guarded)
    return excesses(_numbers(outcome), limits)


def _numbers(outcome: Outcome) -> Mapping[str, Measured]:
    """Return what was measured, and how the channels compare as the present program compares them."""
    return {**outcome.numbers, ALIKE.name: ALIKE.measure(outcome.numbers)}


def told(outcome: Outcome) -> tuple[str, ...]:
    """Return the leading suspects of a flagged hand, as `Outcome.suspects` has them, judged anew.

    A run that an error ended has those that it was given then: its error is not stored.
    """
    trial = outcome.trial
    if outcome.ended:
        return outcome.suspects
    judge = Judge(trial.firmware, guarded=trial.guarded)
    signs = judge.signs(_numbers(outcome), FINISHED)
    return tuple(map(written, Diagnosis(suspected(signs, clues(signs))).leading))


def right_part(fault: Injection, suspects: Collection[str]) -> bool:
    """Return whether the part at fault is among suspects; of a channel its servo or its digit, which no run splits."""
    if fault.channel is not None and any(suspect.endswith(f"/{fault.channel.label}") for suspect in suspects):
        return True
    return not {part.name for part in fault.parts}.isdisjoint(suspects)


def detections(outcomes: Iterable[Outcome]) -> tuple[Detection, ...]:
    """Return a row for each fault and severity, in the order of the catalogue."""
    groups: dict[tuple[str, float], list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        if len(outcome.trial.faults) == 1 and outcome.ended != NOT_FIRED:
            fault = parse_fault(outcome.trial.faults[0])
            groups[fault.name, fault.severity].append(outcome)
    order = list(CATALOGUE)
    return tuple(
        _detection(name, severity, groups[name, severity])
        for name, severity in sorted(groups, key=lambda key: (order.index(key[0]), _rank(*key)))
    )


def _detection(name: str, severity: float, group: Sequence[Outcome]) -> Detection:
    failed: dict[str, int] = defaultdict(int)
    found = located = 0
    furthest = 0.0
    for outcome in group:
        if not flagged(outcome):
            furthest = max(furthest, *(abs(excess or 0.0) for excess in judged(outcome).values()), 0.0)
            continue
        found += 1
        for check in {f"{key[0]}/{key[1]}" for key, excess in judged(outcome).items() if not within_limits(excess)}:
            failed[check] += 1
        if outcome.stopped:
            failed[f"stopped: {outcome.ended or 'gate'}"] += 1
        fault = parse_fault(outcome.trial.faults[0])
        located += right_part(fault, told(outcome))
    ranked = tuple(sorted(failed.items(), key=lambda item: (-item[1], item[0])))
    unit = parse_fault(name).unit
    return Detection(name, severity, unit, Share(found, len(group)), ranked, located, furthest)


def false_alarms(outcomes: Iterable[Outcome]) -> tuple[Share, dict[str, int]]:
    """Return how many healthy hands are flagged, and how often each check, `experiment/metric/subject`, did it."""
    healthy = [outcome for outcome in outcomes if not outcome.trial.faults]
    by_check: dict[str, int] = defaultdict(int)
    for outcome in healthy:
        for key, excess in judged(outcome).items():
            if not within_limits(excess):
                by_check["/".join(key)] += 1
    return Share(sum(map(flagged, healthy)), len(healthy)), dict(by_check)


def _rank(name: str, severity: float) -> float:
    """Return how severe a severity of a fault is; for some faults less is worse."""
    steps = CATALOGUE[name].steps()
    return severity if steps[-1] >= steps[0] else -severity


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
            f" Of {sum(row.found.of for row in rows)} faulty hands {found} were found; of "
            f"{sum(row.located for row in rows)} the part at fault is suspected first."
        )
    environment = Environment(
        loader=PackageLoader("train.campaign"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
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
            key = max(found, key=lambda name: _distance(found[name]))
            furthest.append((outcome.trial.key, "/".join(key), _distance(found[key])))
    return sorted(furthest, key=lambda row: -row[2])[:LISTED]


def _distance(excess: float | None) -> float:
    """Return how far a reading is from healthy ones; infinite for one that a healthy hand would have given."""
    return math.inf if excess is None else abs(excess)


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
