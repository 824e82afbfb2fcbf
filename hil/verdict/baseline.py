"""A hand's own figures, kept, and what has become worse since."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from aero.regular_file import read_text
from hil.checks.shared.experiment import Measured
from hil.recordings.seal import KEY, unsealed
from hil.verdict.findings import Finding


@dataclass(frozen=True)
class Tolerance:
    """How much a metric may grow before that counts as worse."""

    experiment: str
    metric: str
    absolute: float
    """In the metric's own unit."""
    relative: float
    """Part of the baseline's value; the greater of both counts."""
    unit: str
    meaning: str
    """What growth usually means."""


LARGEST_BYTES = 16 * 2**20
"""Of the figures of a run, which have some ten thousand."""
FIELDS = {"passed", "measured", "findings", "sight", "explanations", KEY}
"""Of `checks.json`."""
TOLERANCES = (
    Tolerance("staircase", "worst_percent", 1.0, 0.3, "% of range", "It tracks worse: slack, friction or a zero."),
    Tolerance("staircase", "rise_hand_ms", 15.0, 0.2, "ms", "The servo has become slower: friction, supply, heat."),
    Tolerance("staircase", "friction", 0.12, 0.3, "A", "Friction has grown: a joint, a cable path or a gear."),
    Tolerance("staircase", "take_up", 2.0, 0.2, "mm", "A cable has become slack: creep, or a spool that slips."),
    Tolerance("presence", "idle_current", 0.2, 0.5, "A", "The open hand pushes against something it did not before."),
    Tolerance("holding", "holding_current", 0.25, 0.3, "A", "Holding costs more: springs, friction, a blocked digit."),
)
"""What the emulated hand repeats over seeds is far below; these leave room for a day's temperature on a real one."""


def store(results: Path, baseline: Path) -> None:
    """Copy the figures and recordings of a run of `aero-hil validate` into a folder.

    Raises:
        FileNotFoundError: `results` holds no `checks.json`.
        FileExistsError: the folder exists already; a baseline is not overwritten.
    """
    if not (results / "checks.json").is_file():
        raise FileNotFoundError(f"{results} holds no checks.json; give the folder that `aero-hil validate --out` wrote")
    if baseline.exists():
        raise FileExistsError(f"{baseline} exists already; remove it or choose another name")
    baseline.mkdir(parents=True)
    for path in (results / "checks.json", *sorted(results.glob("*.mcap"))):
        shutil.copy2(path, baseline / path.name)


def load(baseline: Path) -> Mapping[str, Measured]:
    """Return what a baseline measured, by experiment.

    Raises:
        ValueError: the folder is no baseline, or is damaged.
    """
    path = baseline / "checks.json"
    try:
        checks = json.loads(read_text(path, LARGEST_BYTES))
        if unknown := sorted(checks.keys() - FIELDS):
            raise ValueError(f"unknown {', '.join(unknown)}")
        checks = unsealed(checks)
        return {
            experiment: {
                subject: {metric: value for metric, value in row.items() if _is_figure(metric, value)}
                for subject, row in rows.items()
            }
            for experiment, rows in checks["measured"].items()
        }
    except (OSError, LookupError, TypeError, AttributeError, ValueError, RecursionError) as error:
        raise ValueError(f"{baseline} is no baseline of `aero-hil baseline`: {error}") from error


def _is_figure(metric: str, value: object) -> bool:
    """Return whether a metric has a value; one that could not be measured is kept as null."""
    if not (value is None or isinstance(value, (int, float, str))) or isinstance(value, bool):
        raise TypeError(f"{metric} is {value!r}, not a number")
    if isinstance(value, (int, float)) and not math.isfinite(value):
        raise ValueError(f"{metric} is {value}")
    return isinstance(value, (int, float))


def regressions(before: Mapping[str, Measured], now: Mapping[str, Measured], where: str) -> tuple[Finding, ...]:
    """Compare with a baseline whatever both measured; `where` names the baseline in the findings."""
    return tuple(
        _judge(tolerance, subject, then[tolerance.metric], float(row[tolerance.metric]), where)
        for tolerance in TOLERANCES
        for subject, row in now.get(tolerance.experiment, {}).items()
        if tolerance.metric in row
        and (then := before.get(tolerance.experiment, {}).get(subject, {})).get(tolerance.metric) is not None
    )


def _judge(tolerance: Tolerance, subject: str, then: float, value: float, where: str) -> Finding:
    allowed = abs(then) + max(tolerance.absolute, tolerance.relative * abs(then))
    return Finding(
        check=f"{tolerance.metric} against the baseline",
        subject=subject,
        passed=abs(value) <= allowed,
        measured=f"{value:.4g} {tolerance.unit}, was {then:.4g}",
        expected=f"at most {allowed:.4g}",
        source=f"baseline {where}",
        meaning=tolerance.meaning,
        remedy=f"Compare the recordings of both: `aero-hil diff {where}/{tolerance.experiment}.mcap` with this run's.",
    )
