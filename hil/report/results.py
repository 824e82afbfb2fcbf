"""The folder of results that a validation leaves: recordings, `checks.json`, `metrics.json`, the figure, the report."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

from aero.whole_file import whole, write_whole
from hil.checks.staircase import EXPERIMENT as STAIRCASE
from hil.checks.staircase.tracking import staircase_metrics
from hil.recordings.seal import sealed
from hil.report.page import render_report
from hil.report.plots import validation_figure
from hil.verdict.judged_run import Validation
from hil.verdict.sight import Sight, load_sight

PUBLISHED = (
    "unit",
    "excursion_model",
    "excursion_hand",
    "tracking_rms",
    "rise_model_ms",
    "rise_hand_ms",
    "overshoot_hand_percent",
    "settled_samples",
    "matched_steps",
)
"""Fields of a channel in `metrics.json`; others script against them."""


def write_figures(validation: Validation, out: Path) -> None:
    """Write `checks.json`, and `metrics.json` when there was a staircase, into a folder.

    Raises:
        OSError: the folder cannot be written.
    """
    write_whole(out / "checks.json", json.dumps(sealed(checks_json(validation)), indent=2) + "\n")
    if validation.measured(STAIRCASE.name) is not None:
        write_whole(out / "metrics.json", json.dumps(metrics_json(validation), indent=2) + "\n")


def write_results(validation: Validation, out: Path) -> None:
    """Write the figures, the report and its picture into the folder of the run's recordings.

    Raises:
        OSError: the folder cannot be written.
    """
    write_figures(validation, out)
    if validation.measured(STAIRCASE.name) is not None:
        with whole(out / "validation.svg") as draft:
            validation_figure(validation.results[STAIRCASE.name].recording).savefig(draft)
    names = [*validation.judged, *(cut.header.experiment for cut in validation.broken_off)]
    files = {name: f"{name}.mcap" for name in names if (out / f"{name}.mcap").exists()}
    write_whole(out / "report.html", render_report(validation, files))


def metrics_json(validation: Validation) -> dict[str, object]:
    """Return the content of `metrics.json`, all about the staircase; a number that could not be measured is null."""
    recording = validation.results[STAIRCASE.name].recording
    header = recording.header
    return {
        "target": header.target,
        "firmware": header.firmware,
        "hand": header.hand,
        "seed": header.seed,
        "hand_seconds": float(recording["hand"].times[-1]),
        "wall_seconds": validation.wall_seconds,
        "channels": {
            channel.label: {name: _jsonable(getattr(row, name)) for name in PUBLISHED}
            for channel, row in staircase_metrics(recording).items()
        },
    }


def checks_json(validation: Validation) -> dict[str, object]:
    """Return the content of `checks.json`: what every experiment measured, and every finding."""
    return {
        "passed": validation.passed,
        "measured": {
            name: {
                subject: {metric: _jsonable(value) for metric, value in row.items()}
                for subject, row in measured.items()
            }
            for name, measured in validation.numbers.items()
        },
        "findings": [dataclasses.asdict(finding) for finding in validation.findings],
        "sight": {check: dataclasses.asdict(sight) for check, sight in _sight(validation).items()},
        "explanations": [
            dataclasses.asdict(explanation)
            | {"channel": None if explanation.channel is None else explanation.channel.label}
            for explanation in validation.explanations
        ],
    }


def _sight(validation: Validation) -> dict[str, Sight]:
    """Return what the checks of a run can see, as far as it is known."""
    known = load_sight()
    names = {f"{name}/{finding.check}" for name, result in validation.results.items() for finding in result.findings}
    return {check: known[check] for check in sorted(names & known.keys())}


def _jsonable(value: float | str) -> float | str | None:
    return None if isinstance(value, float) and not math.isfinite(value) else value
