"""The main job: run experiments on a target and judge them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from aero.channels import Channel
from aero.errors import AeroError
from aero.safety import SafetyStopError
from hil.experiments import DEFAULT, EXPERIMENTS, Experiment
from hil.judging.baseline import load, regressions
from hil.judging.findings import Finding, failed
from hil.judging.judged_run import Result, Validation
from hil.judging.limits import Limit, compare, load_limits
from hil.recordings.recorder import Progress, Recorder, silent
from hil.recordings.recording import Recording
from hil.targets.target import PHYSICAL, Target
from model.units import DEFAULT_LIMITS, load_unit

SESSION = "session"
"""Name in the header of the recording that holds every byte since the hand was opened."""
STOP_SHARE = 0.97
"""Part of a window from which on a channel may meet its stop."""


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
        if EXPERIMENTS[name].gate and failed(results[name].findings) and name != names[-1]:
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
        experiment = EXPERIMENTS[header.experiment]
        measured = experiment.measure(recording)
        findings = compare(experiment, measured, load_limits(kind, header.firmware))
        results[header.experiment] = Result(recording, measured, findings)
    return Validation(results, None, time.perf_counter() - start)


def _judged(experiment: Experiment, target: Target, limits: tuple[Limit, ...], progress: Progress) -> Result:
    if any(experiment.furthest):
        target.begin(stops=[channel for channel in Channel if experiment.furthest[channel] >= STOP_SHARE])
    recording = experiment.run(target, progress)
    measured = experiment.measure(recording)
    return Result(recording, measured, compare(experiment, measured, limits))


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
