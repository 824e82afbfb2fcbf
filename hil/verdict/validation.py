"""The main job: run experiments on a target and judge them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from aero.channels import Channel
from aero.errors import AeroError
from aero.safety import SafetyStopError
from firmware_emulator.native.program import FirmwareProgramError
from hil.checks import DEFAULT, DRIVER, EXPERIMENTS, WHOLE_RUN, Experiment, Measured
from hil.checks.shared.experiment import map_of
from hil.recordings.recorder import Progress, Recorder, silent
from hil.recordings.recording import Header, Recording
from hil.targets.target import PHYSICAL, Target
from hil.verdict.baseline import load, regressions
from hil.verdict.diagnose import diagnose
from hil.verdict.ending import EndSignature
from hil.verdict.explanation import HEALTHY, Diagnosis
from hil.verdict.findings import Finding, failed
from hil.verdict.judged_run import Result, Validation
from hil.verdict.limits import Limit, compare, load_limits
from hil.verdict.other_firmware import limits_of_others
from hil.verdict.own_limits import OwnLimits
from hil.verdict.run_end import FINISHED, RunEnd, Way, broken_off
from model.units import DEFAULT_LIMITS, shipped_units
from model.units.naming import PLAUSIBLE, unit_named

STOPPING = (AeroError, SafetyStopError, OSError, FirmwareProgramError, KeyboardInterrupt, SystemExit)
"""What ends a run before its time, and leaves what was recorded."""
STOP_SHARE = 0.97
"""Part of a window from which on a channel may meet its stop."""


def validate(
    target: Target,
    names: Sequence[str] = DEFAULT,
    *,
    baseline: Path | None = None,
    folder: Path | None = None,
    progress: Progress = silent,
    on_result: Callable[[Validation], None] = lambda _: None,
) -> Validation:
    """Run experiments on a target and judge them by its kind's limits.

    Ctrl-C and a signal that `aero.safety.unwinding` turns into an exit end the run and are noted in what is returned.

    The firmware's own speed and torque limits hold meanwhile; those that this program had set are given back.

    Args:
        target: the hand; most experiments move it through its whole range.
        names: experiments to run, keys of `EXPERIMENTS`.
        baseline: folder of the hand's own earlier figures, to compare with.
        folder: where recordings are written as they are made, NAME.mcap and session.mcap; nowhere when None.
        progress: called with the finished part of the present experiment.
        on_result: called with everything so far after each experiment.

    Returns:
        Results up to the first experiment that could not end, or to a failed gate. What the guard permits no hand with
        this firmware is left out, and the verdict is on the rest.

    Raises:
        OSError: a recording cannot be begun.
        ValueError: the baseline is none.
    """
    start = time.perf_counter()
    limits = load_limits(target.limits, target.firmware, guarded=target.guard is not None)
    before = load(baseline) if baseline else {}
    results: dict[str, Result] = {}
    left_out = [name for name in names if EXPERIMENTS[name].pushes_at_stops and not target.may_push_at_stops]
    names = [name for name in names if name not in left_out]

    def so_far(end: RunEnd = FINISHED) -> Validation:
        measured = {name: result.measured for name, result in results.items()}
        worse = regressions(before, measured, str(baseline))
        return Validation(dict(results), end, time.perf_counter() - start, worse, left_out=tuple(left_out))

    def recorder(name: str) -> Recorder:
        return Recorder(target, name, None if folder is None else folder / f"{name}.mcap")

    session, end, limits_on_board = recorder(WHOLE_RUN.name), FINISHED, OwnLimits(target)
    session.begin(from_opening=True)
    for name in names:
        experiment, record = EXPERIMENTS[name], recorder(name)
        gate = _failed_gate(results)
        if gate is not None and not (experiment.gentle and _gentle_allowed(gate)):
            end = RunEnd(Way.GATE, gate.recording.header.experiment)
            break
        try:
            if any(experiment.furthest):
                limits_on_board.set()
                target.begin(stops=[channel for channel in Channel if experiment.furthest[channel] >= STOP_SHARE])
            experiment.run(target, record, progress)
        except STOPPING as error:
            end = broken_off(name, error, (record.finish(ended=False),) if record.begun else ())
            break
        results[name] = _judged(experiment, record.finish(), limits)
        on_result(so_far())
    if left_out and not names:
        end = _nothing_run(left_out, target.firmware)
    limits_on_board.give_back()
    whole = session.finish(ended=end.error is None)
    done = replace(
        so_far(end), session=whole, whole_run=_link_judged(whole, limits), driver=_driver_judged(results, limits)
    )
    if not done.passed:
        done = replace(done, diagnosis=_diagnosed(done, limits))
    return done


def judge_recordings(recordings: Sequence[Recording]) -> Validation:
    """Measure and judge recordings made earlier, by the limits of the hand in their headers.

    The recording of a whole session, which `validate` writes too, tells about the link.

    Raises:
        ValueError: a recording is of no experiment of `EXPERIMENTS`, or its unit or its limits are unknown.
    """
    start = time.perf_counter()
    results: dict[str, Result] = {}
    session: Result | None = None
    cut = tuple(r for r in recordings if not r.header.finished and r.header.experiment != WHOLE_RUN.name)
    for recording in recordings:
        header = recording.header
        map_of(header)  # an unknown firmware or window is the file's fault, and no finding about the hand
        if header.experiment == WHOLE_RUN.name:
            session = _link_judged(recording, limits_of(header)) if header.finished else None
            continue
        if header.experiment not in EXPERIMENTS:
            raise ValueError(f"there is no experiment {header.experiment!r}; there are {', '.join(EXPERIMENTS)}")
        if not header.finished:
            continue
        limits = limits_of(header)
        results[header.experiment] = _judged(EXPERIMENTS[header.experiment], recording, limits)
    end = RunEnd(Way.CUT, cut[0].header.experiment, cut=cut) if cut else FINISHED
    done = Validation(results, end, time.perf_counter() - start, whole_run=session)
    if not results:
        return done
    limits = limits_of(next(iter(results.values())).recording.header)
    done = replace(done, driver=_driver_judged(results, limits))
    return done if done.passed else replace(done, diagnosis=_diagnosed(done, limits))


def _link_judged(session: Recording, limits: tuple[Limit, ...]) -> Result:
    measured = WHOLE_RUN.measure(session)
    return Result(session, measured, compare(WHOLE_RUN, measured, limits))


def _driver_judged(results: Mapping[str, Result], limits: tuple[Limit, ...]) -> Result | None:
    """Return what the bytes of all experiments say about driver and map, None where no experiment ended."""
    if not results:
        return None
    recordings = [result.recording for result in results.values()]
    measured = _worst([DRIVER.measure(recording) for recording in recordings])
    return Result(recordings[-1], measured, compare(DRIVER, measured, limits))


def _worst(measured: Sequence[Measured]) -> Measured:
    return {
        subject: {name: max(one[subject][name] for one in measured) for name in metrics}
        for subject, metrics in measured[0].items()
    }


def limits_of(header: Header) -> tuple[Limit, ...]:
    """Return the limits that a recording is judged by.

    Raises:
        ValueError: the header does not name them, and its unit is none that ships.
    """
    return load_limits(_kind(header), header.firmware, guarded=bool(header.safety))


def _kind(header: Header) -> str:
    """Return the kind of hand of a recording.

    Raises:
        ValueError: as `limits_of`.
    """
    return header.limits or _limits_of_unit(header.unit)


def _limits_of_unit(unit: str) -> str:
    """Return the kind of hand of a recording that does not name it, as those of version 0.1.0 do not.

    Raises:
        ValueError: the unit was a file, which is not opened because a recording names it.
    """
    if unit == PHYSICAL or unit.startswith(PLAUSIBLE):
        return DEFAULT_LIMITS
    if unit not in shipped_units():
        raise ValueError(f"this recording of unit {unit!r} does not say which limits it is judged by; record it again")
    return unit_named(unit).limits


def _diagnosed(done: Validation, limits: tuple[Limit, ...]) -> Diagnosis:
    """Return where a run's failures come from, and what caused them.

    Nothing is known where a person or the guard ended it, or where a person sees what no reading shows.
    """
    if done.end.way in {Way.PERSON, Way.GUARD}:
        return HEALTHY
    asking = {name for name, experiment in EXPERIMENTS.items() if experiment.asks}
    numbers = {name: measured for name, measured in done.numbers.items() if name not in asking}
    if done.end.error is None and not any(
        failed(result.findings) for name, result in done.judged.items() if name not in asking
    ):
        return HEALTHY
    ending = EndSignature.of(done.end)
    if not done.results:
        return diagnose(numbers, limits, ending)
    header = next(iter(done.results.values())).recording.header
    others = limits_of_others(_kind(header), header.firmware, guarded=bool(header.safety))
    return diagnose(numbers, limits, ending, header.firmware, others)


def _nothing_run(left_out: Sequence[str], firmware: str) -> RunEnd:
    """Return the end of a run of nothing but experiments that the guard permits no hand with this firmware."""
    at = ", ".join(left_out)
    reason = (
        f"Firmware {firmware} has no torque limit, so the palm would stall the thumb at full torque, and the guard "
        "would stop the hand for its current."
    )
    return RunEnd(Way.GUARD, at, reason, SafetyStopError(f"{at} not run. {reason}"))


def _failed_gate(results: Mapping[str, Result]) -> Result | None:
    """Return the gate that failed, None when none did."""
    return next((one for name, one in results.items() if EXPERIMENTS[name].gate and failed(one.findings)), None)


def _gentle_allowed(result: Result) -> bool:
    """Return whether what failed at a gate lets the hand be moved gently."""
    allowed = EXPERIMENTS[result.recording.header.experiment].gentle_after
    return all(finding.check in allowed for finding in failed(result.findings))


def _judged(experiment: Experiment, recording: Recording, limits: tuple[Limit, ...]) -> Result:
    """Measure and judge; a hand that moved in no way that can be measured fails, and is no mistake of the program."""
    try:
        measured = experiment.measure(recording)
    except ValueError as error:
        return Result(recording, {}, (_not_measured(experiment.name, str(error)),))
    return Result(recording, measured, compare(experiment, measured, limits))


def _not_measured(name: str, reason: str) -> Finding:
    return Finding(
        check=name,
        subject="hand",
        passed=False,
        measured="not measurable",
        expected="measured",
        source="the recording",
        meaning=f"The hand did not move in a way that can be measured: {reason}.",
        remedy="Mend what the other checks found, then validate again.",
    )
