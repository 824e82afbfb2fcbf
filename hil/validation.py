"""The main job: one staircase through the whole chain, judged, and everything it leaves on disk."""

from __future__ import annotations

import dataclasses
import json
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from aero.channels import Channel
from hil.findings import Finding, failed
from hil.limits import compare, load_limits
from hil.mcap_file import write_recording
from hil.metrics import ChannelMetrics, staircase_metrics
from hil.plots import validation_figure
from hil.recorder import Progress, silent
from hil.recording import Recording
from hil.report import render_report
from hil.residuals import attribute
from hil.staircase import Staircase, run_staircase
from hil.target import Target
from model import RoutedHand

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


@dataclass(frozen=True)
class Validation:
    """A judged staircase."""

    recording: Recording
    metrics: Mapping[Channel, ChannelMetrics]
    findings: tuple[Finding, ...]
    wall_seconds: float
    """Time from the start to the verdict, s."""

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return not failed(self.findings)


def validate(target: Target, plan: Staircase | None = None, *, progress: Progress = silent) -> Validation:
    """Run the staircase on a target and judge it by its kind's limits; the hand moves through its whole range."""
    start = time.perf_counter()
    recording = run_staircase(target, RoutedHand(target.side), plan, progress=progress)
    metrics = staircase_metrics(recording)
    measured = {channel.label: dataclasses.asdict(row) for channel, row in metrics.items()}
    findings = compare("staircase", measured, load_limits(target.limits, target.firmware))
    return Validation(recording, metrics, findings, time.perf_counter() - start)


def write_results(validation: Validation, out: Path) -> None:
    """Write `report.html`, `metrics.json`, `staircase.mcap` and `validation.svg` into a folder, made when missing.

    Raises:
        OSError: the folder cannot be written.
    """
    out.mkdir(parents=True, exist_ok=True)
    recording = validation.recording
    report = render_report(
        recording,
        validation.metrics,
        validation.findings,
        attribute(recording),
        wall_seconds=validation.wall_seconds,
    )
    (out / "report.html").write_text(report, encoding="utf-8")
    (out / "metrics.json").write_text(json.dumps(metrics_json(validation), indent=2) + "\n", encoding="utf-8")
    write_recording(recording, out / "staircase.mcap")
    validation_figure(recording).savefig(out / "validation.svg")


def metrics_json(validation: Validation) -> dict[str, object]:
    """Return the content of `metrics.json`; a number that could not be measured is null."""
    recording = validation.recording
    channels = {
        channel.label: {name: _jsonable(getattr(row, name)) for name in PUBLISHED}
        for channel, row in validation.metrics.items()
    }
    header = recording.header
    return {
        "target": header.target,
        "firmware": header.firmware,
        "hand": header.hand,
        "seed": header.seed,
        "hand_seconds": float(recording["hand"].times[-1]),
        "wall_seconds": validation.wall_seconds,
        "channels": channels,
    }


def _jsonable(value: float | str) -> float | str | None:
    return None if isinstance(value, float) and math.isnan(value) else value
