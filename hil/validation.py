"""The main job: run experiments on a target, judge them, and write down everything."""

from __future__ import annotations

import dataclasses
import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from aero.channels import Channel
from aero.errors import AeroError
from aero.safety import SafetyStopError
from hil.baseline import load, regressions
from hil.experiments import DEFAULT, EXPERIMENTS, GATES, Experiment, Measured
from hil.experiments.staircase import STAIRCASE
from hil.findings import Finding, failed
from hil.limits import Limit, compare, load_limits
from hil.mcap_file import write_recording
from hil.metrics import staircase_metrics
from hil.plots import validation_figure
from hil.recorder import Progress, Recorder, silent
from hil.recording import Recording
from hil.report import render_report
from hil.target import PHYSICAL, Target
from hil.units import DEFAULT_LIMITS, load_unit

SESSION = "session"
"""Name in the header of the recording that holds every byte since the hand was opened."""
STOP_SHARE = 0.97
"""Part of a window from which on a channel may meet its stop."""
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
class Result:
    """One experiment that ran to its end."""

    recording: Recording
    measured: Measured
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class Validation:
    """A judged run of experiments."""

    results: Mapping[str, Result]
    """By experiment, in the order in which they ran."""
    stopped: Finding | None
    """What kept the rest from running, None when all ran."""
    wall_seconds: float
    """Time from the start to the verdict, s."""
    regressions: tuple[Finding, ...] = ()
    """Comparison with the hand's own baseline, when there is one."""
    session: Recording | None = None
    """Every byte since the hand was opened, for an exact replay; None when judged from files."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Every finding, and the reason for stopping if there is one."""
        found = tuple(finding for result in self.results.values() for finding in result.findings) + self.regressions
        return found if self.stopped is None else (self.stopped, *found)

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return not failed(self.findings)

    @property
    def hand_seconds(self) -> float:
        """Hand time of all recordings, s."""
        return sum(float(result.recording["codes"].times[-1]) for result in self.results.values())


def validate(
    target: Target,
    names: Sequence[str] = DEFAULT,
    *,
    baseline: Path | None = None,
    progress: Progress = silent,
) -> Validation:
    """Run experiments on a target and judge them by its kind's limits.

    Args:
        target: the hand; most experiments move it through its whole range.
        names: experiments to run, keys of `EXPERIMENTS`.
        baseline: folder of the hand's own earlier figures, to compare with.
        progress: called with the finished part of the present experiment.

    Returns:
        Results up to the first experiment that could not end, or to a failed gate.
    """
    start = time.perf_counter()
    limits = load_limits(target.limits, target.firmware)
    before = load(baseline) if baseline else {}
    results: dict[str, Result] = {}
    stopped = None
    for name in names:
        try:
            results[name] = _judged(EXPERIMENTS[name], target, limits, progress)
        except (AeroError, SafetyStopError, ConnectionError) as error:
            stopped = _broken_off(name, error)
            break
        if name in GATES and failed(results[name].findings) and name != names[-1]:
            stopped = _kept_back(name)
            break
    measured = {name: result.measured for name, result in results.items()}
    return Validation(
        results,
        stopped,
        time.perf_counter() - start,
        regressions(before, measured, str(baseline)),
        Recorder(target, from_opening=True).finish(SESSION, {}),
    )


def judge_recordings(recordings: Sequence[Recording]) -> Validation:
    """Measure and judge recordings made earlier, by the limits of the hand in their headers.

    The recording of a whole session, which `validate` writes too, has no figures of its own and is passed over.

    Raises:
        ValueError: a recording is of no experiment of `EXPERIMENTS`, or its unit or its limits are unknown.
    """
    start = time.perf_counter()
    results: dict[str, Result] = {}
    for recording in recordings:
        header = recording.header
        if header.experiment == SESSION:
            continue
        if header.experiment not in EXPERIMENTS:
            raise ValueError(f"there is no experiment {header.experiment!r}; there are {', '.join(EXPERIMENTS)}")
        kind = DEFAULT_LIMITS if header.unit == PHYSICAL else load_unit(header.unit).limits
        measured = EXPERIMENTS[header.experiment].measure(recording)
        findings = compare(header.experiment, measured, load_limits(kind, header.firmware))
        results[header.experiment] = Result(recording, measured, findings)
    return Validation(results, None, time.perf_counter() - start)


def write_results(validation: Validation, out: Path) -> None:
    """Write the report, every recording, and `metrics.json` when there was a staircase, into a folder.

    Raises:
        OSError: the folder cannot be written.
    """
    out.mkdir(parents=True, exist_ok=True)
    for name, result in validation.results.items():
        write_recording(result.recording, out / f"{name}.mcap")
    if validation.session is not None:
        write_recording(validation.session, out / "session.mcap")
    (out / "checks.json").write_text(json.dumps(checks_json(validation), indent=2) + "\n", encoding="utf-8")
    if STAIRCASE.name in validation.results:
        (out / "metrics.json").write_text(json.dumps(metrics_json(validation), indent=2) + "\n", encoding="utf-8")
        validation_figure(validation.results[STAIRCASE.name].recording).savefig(out / "validation.svg")
    (out / "report.html").write_text(render_report(validation), encoding="utf-8")


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
                for subject, row in result.measured.items()
            }
            for name, result in validation.results.items()
        },
        "findings": [dataclasses.asdict(finding) for finding in validation.findings],
    }


def _judged(experiment: Experiment, target: Target, limits: tuple[Limit, ...], progress: Progress) -> Result:
    if any(experiment.furthest):
        target.begin(stops=[channel for channel in Channel if experiment.furthest[channel] >= STOP_SHARE])
    recording = experiment.run(target, progress)
    measured = experiment.measure(recording)
    return Result(recording, measured, compare(experiment.name, measured, limits))


def _broken_off(name: str, error: Exception) -> Finding:
    return Finding(
        check=name,
        subject="hand",
        passed=False,
        measured="broken off",
        expected="run to its end",
        source="the driver",
        meaning=str(error),
        remedy="Mend this first; what comes after it was not run.",
    )


def _kept_back(name: str) -> Finding:
    return Finding(
        check=f"after {name}",
        subject="hand",
        passed=False,
        measured="not run",
        expected="run",
        source=f"a hand that fails {name} is not moved",
        meaning=f"The checks of {name} failed, so nothing that moves the hand was run.",
        remedy=f"Mend what {name} found, then validate again.",
    )


def _jsonable(value: float | str) -> float | str | None:
    return None if isinstance(value, float) and math.isnan(value) else value
