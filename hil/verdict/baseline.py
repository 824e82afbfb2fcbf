"""A hand's own figures, kept, and what has become worse since."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Mapping
from pathlib import Path

from aero.regular_file import read_text
from hil.checks import JUDGED, Measured
from hil.checks.shared.declaration import Metric, Worse
from hil.recordings.errors import writing
from hil.verdict.findings import Finding

LARGEST_BYTES = 16 * 2**20
"""Of the figures of a run, which have some ten thousand."""
FIELDS = {"passed", "not_run", "counts", "measured", "findings", "diagnosis", "withheld"}
FORMER_FIELDS = {"sight", "explanations", "sha256"}
"""Of `checks.json`, now and in earlier versions."""


def store(results: Path, baseline: Path) -> None:
    """Copy the figures and recordings of a run of `aero-hil validate` into a folder.

    Raises:
        FileNotFoundError: `results` holds no `checks.json`.
        FileExistsError: the folder exists already; a baseline is not overwritten.
        CannotBeWrittenError: the folder cannot be written; none is left.
    """
    if not (results / "checks.json").is_file():
        raise FileNotFoundError(f"{results} holds no checks.json; give the folder that `aero-hil validate --out` wrote")
    if baseline.exists():
        raise FileExistsError(f"{baseline} exists already; remove it or choose another name")
    draft = baseline.with_name(f".{os.getpid()}.{baseline.name}")
    try:
        with writing(baseline):
            draft.mkdir(parents=True)
            for path in (results / "checks.json", *sorted(results.glob("*.mcap"))):
                shutil.copy2(path, draft / path.name)
            draft.rename(baseline)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise


def load(baseline: Path) -> Mapping[str, Measured]:
    """Return what a baseline measured, by experiment.

    Raises:
        ValueError: the folder is no baseline, or is damaged.
    """
    path = baseline / "checks.json"
    try:
        checks = json.loads(read_text(path, LARGEST_BYTES))
        if unknown := sorted(checks.keys() - FIELDS - FORMER_FIELDS):
            raise ValueError(f"unknown {', '.join(unknown)}")
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
    """Compare with a baseline whatever both measured; `where` names the baseline in the findings.

    What the emulated hand repeats over seeds is far below what a metric may grow by; that leaves room for a day's
    temperature on a real one.
    """
    return tuple(
        _judge(metric, metric.worse, subject, (then, float(now[name][subject][metric.name])), f"{where}/{name}.mcap")
        for name, measuring in JUDGED.items()
        for metric in measuring.metrics
        for subject in metric.subjects
        if metric.worse is not None
        and metric.name in now.get(name, {}).get(subject, {})
        and (then := before.get(name, {}).get(subject, {}).get(metric.name)) is not None
    )


def _judge(metric: Metric, worse: Worse, subject: str, values: tuple[float, float], recording: str) -> Finding:
    then, value = values
    allowed = abs(then) + max(worse.by, worse.share * abs(then))
    return Finding(
        check=f"{metric.name} against the baseline",
        subject=subject,
        passed=abs(value) <= allowed,
        measured=f"{value:.4g} {metric.unit}, was {then:.4g}",
        expected=f"at most {allowed:.4g}",
        source=f"baseline {Path(recording).parent}",
        meaning=worse.meaning,
        remedy=f"Compare the recordings of both: `aero-hil report` of this run's, `--beside {recording}`.",
        words=f"{metric.words} against the baseline",
    )
