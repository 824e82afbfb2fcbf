"""Validation: experiments run on a target and judged."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import datetime, timedelta
from itertools import combinations
from pathlib import Path

from aero.channels import Channel
from aero.errors import AeroError
from aero.firmware import firmware_of
from aero.protocol import Opcode
from aero.safety import SafetyStopError
from aero.safety.interrupts import stops_held, stops_let_through
from hil.checks import DEFAULT, EXPERIMENTS, WHOLE_RUN
from hil.checks.shared.experiment import map_of
from hil.recordings.errors import NotOneHandError
from hil.recordings.recorder import Progress, Recorder, silent
from hil.recordings.recording import Header, Recording
from hil.targets.target import Target
from hil.verdict.baseline import load, regressions
from hil.verdict.findings import failed
from hil.verdict.judge import Judge
from hil.verdict.judged_run import Result, Validation
from hil.verdict.run_end import END_BY_ERROR, FINISHED, EndKind, RunEnd, aborted

STOP_SHARE = 0.97
"""Threshold of the commanded fraction of a window; at or above it the channel may meet its end stop."""


def validate(
    target: Target,
    names: Sequence[str] = DEFAULT,
    *,
    baseline: Path | None = None,
    folder: Path | None = None,
    from_opening: bool = True,
    progress: Progress = silent,
    on_result: Callable[[Validation], None] = lambda _: None,
) -> Validation:
    """Run experiments on a target and judge the results by the limits for such hands.

    Ctrl-C and the signals of `aero.safety.unwinding` end the run while an experiment moves; the result has the signal
    as its end. Between motions they are held until the next one, or until the result is complete.

    The run uses the firmware's own speed and torque limits; afterwards, even after an error of `on_result`, the limits
    set by this program are restored and the recordings are closed.

    Args:
        target: the hand; most experiments move it through its whole range.
        names: experiments to run, keys of `EXPERIMENTS`.
        baseline: folder with the hand's baseline; None for no comparison.
        folder: folder of the recordings NAME.mcap and session.mcap, written during the run; None for no files.
        from_opening: True to judge the link since the hand was opened, False from now on.
        progress: called with the finished fraction of the current experiment.
        on_result: called with all results so far after each experiment.

    Returns:
        Results up to an aborted experiment or a failed gate. Experiments that the guard refuses with this firmware are
        omitted, and the verdict excludes them.

    Raises:
        OSError: a recording cannot be created.
        UnusableFileError: the baseline is invalid, or of another hand.
    """
    start = time.perf_counter()
    judge, before = Judge.of_target(target), None if baseline is None else load(baseline)
    if before is not None:
        identity = {"side": target.side, "firmware": target.firmware, "unit": target.unit, "hand_id": target.hand_id}
        before.require_same(identity)
    left_out = tuple(name for name in names if EXPERIMENTS[name].pushes_at_stops and not target.may_push_at_stops)
    chosen = [name for name in names if name not in left_out]
    results: dict[str, Result] = {}
    end = _nothing_run(left_out, target.firmware) if left_out and not chosen else FINISHED

    def so_far(end: RunEnd = FINISHED) -> Validation:
        measured = {name: result.measured for name, result in results.items()}
        worse = () if before is None else regressions(before, measured)
        return Validation(
            dict(results), end, time.perf_counter() - start, worse, planned=tuple(chosen), left_out=left_out
        )

    def recorder(name: str) -> Recorder:
        return Recorder(target, name, None if folder is None else folder / f"{name}.mcap")

    with stops_held(), _recorded(recorder(WHOLE_RUN.name)) as session:
        session.begin(from_opening=from_opening)
        with _own_limits(target) as set_limits:
            for name in chosen:
                gate = _failed_gate(results)
                if gate is not None and not (EXPERIMENTS[name].gentle and _gentle_allowed(gate)):
                    end = RunEnd(EndKind.GATE, gate.recording.header.experiment)
                    break
                with _recorded(recorder(name)) as record:
                    try:
                        with stops_let_through():
                            _run(target, name, record, progress, set_limits)
                    except (*END_BY_ERROR, *target.program_errors) as error:
                        end = aborted(name, error, (record.finish(ended=False),) if record.begun else ())
                        break
                    recording = record.finish()
                results[name] = judge.experiment(EXPERIMENTS[name], recording)
                on_result(so_far())
        whole = session.finish(ended=end.error is None)
        return judge.judged(replace(so_far(end), session=whole, whole_run=judge.link(whole)), folder)


@contextmanager
def _recorded(recorder: Recorder) -> Iterator[Recorder]:
    """Finish a recorder even after an exception, so that its file, log handler and tap are closed."""
    try:
        yield recorder
    except BaseException:
        if recorder.begun:
            recorder.finish(ended=False)
        raise


def _run(target: Target, name: str, record: Recorder, progress: Progress, set_limits: Callable[[], None]) -> None:
    experiment = EXPERIMENTS[name]
    if any(experiment.furthest):
        set_limits()
        target.begin(stops=[channel for channel in Channel if experiment.furthest[channel] >= STOP_SHARE])
    experiment.run(target, record, progress)


@contextmanager
def _own_limits(target: Target) -> Iterator[Callable[[], None]]:
    """Yield a function that sets the firmware's own limits; on exit restore the limits that this program had set.

    A board does not report its limits, so limits from another program are overwritten for good, as by a restart. A
    guarded hand keeps the guard's limits. A board without limit commands runs an older firmware than declared, which
    the experiments reveal. Errors while restoring are ignored.
    """
    hand, before = target.hand, target.hand.settings_sent
    own = None if target.guard is not None else firmware_of(target.firmware).settings
    asked = changed = False

    def set_once() -> None:
        nonlocal asked, changed
        if asked:
            return
        asked = True
        if own is None or not hand.knows(Opcode.SET_TOR):
            return
        changed = True
        for channel in Channel:
            hand.set_speed(channel, own.speed)
            hand.set_torque(channel, own.torque)

    try:
        yield set_once
    finally:
        if changed:
            with suppress(AeroError, SafetyStopError, OSError):
                for (opcode, channel), value in before.items():
                    (hand.set_speed if opcode is Opcode.SET_SPE else hand.set_torque)(channel, value)


ONE_HAND = ("side", "firmware", "window", "unit", "hand_id", "faults")
"""Header fields that must agree between recordings of one hand; an empty field is unknown."""


def require_one_run(named: Mapping[str, Recording]) -> None:
    """Check that recordings, by file name, are of one run: one hand, and one recording per experiment.

    Raises:
        NotOneHandError: two recordings disagree; the message names them.
    """
    seen: dict[str, str] = {}
    # Choosing silently between two recordings would make the verdict depend on their order.
    for name, recording in named.items():
        header = recording.header
        if (other := seen.setdefault(header.experiment, name)) != name:
            raise NotOneHandError(f"{other} and {name} are both of {header.experiment}: make a report of each")
    for (one, first), (other, second) in combinations(named.items(), 2):
        if said := _apart(first.header, second.header):
            raise NotOneHandError(f"{one} and {other} are not of one run: {said}; make a report of each")
        for field in ONE_HAND:
            ours, theirs = getattr(first.header, field), getattr(second.header, field)
            if ours != theirs and ((ours and theirs) or field == "faults"):
                said = f"{field.replace('_', ' ')} {ours or 'none'}, the other {theirs or 'none'}"
                raise NotOneHandError(f"{one} and {other} are not of one hand: one has {said}; make a report of each")


LONGEST_RUN = timedelta(days=1)
"""Limit of the time between recordings of one run; above it the hand may have changed."""


def _apart(one: Header, other: Header) -> str:
    """Return a sentence on the time or version gap between two recordings, or ""."""
    if one.commit and other.commit and one.commit != other.commit:
        return f"they were made at the commits {one.commit[:12]} and {other.commit[:12]}"
    if one.started and other.started:
        first, second = (datetime.fromisoformat(header.started).astimezone() for header in (one, other))
        if abs(first - second) > LONGEST_RUN:
            return f"they were made on {first:%Y-%m-%d} and {second:%Y-%m-%d}"
    return ""


def judge_recordings(recordings: Sequence[Recording]) -> Validation:
    """Measure and judge earlier recordings of one hand by the limits for the hand in their headers.

    The recording of a whole session, if present, is used to judge the link.

    Raises:
        ValueError: an unknown experiment, unit or firmware, or recordings of several runs (`require_one_run`).
    """
    start = time.perf_counter()
    require_one_run({f"recording {place}": recording for place, recording in enumerate(recordings, start=1)})
    results: dict[str, Result] = {}
    session: Result | None = None
    judges = [Judge.of_recording(recording.header) for recording in recordings]
    cut = tuple(r for r in recordings if not r.header.finished and r.header.experiment != WHOLE_RUN.name)
    for recording, judge in zip(recordings, judges, strict=True):
        name = recording.header.experiment
        map_of(recording.header)  # an unknown firmware or window is an error of the file, not a finding about the hand
        if name == WHOLE_RUN.name:
            session = judge.link(recording) if recording.header.finished else None
        elif name not in EXPERIMENTS:
            raise ValueError(f"unknown experiment {name!r}; choose from {', '.join(EXPERIMENTS)}")
        elif recording.header.finished:
            results[name] = judge.experiment(EXPERIMENTS[name], recording)
    end = RunEnd(EndKind.INCOMPLETE, cut[0].header.experiment, cut=cut) if cut else FINISHED
    done = Validation(results, end, time.perf_counter() - start, whole_run=session)
    if not results:
        return done
    return Judge.of_recording(next(iter(results.values())).recording.header).judged(done)


def _nothing_run(left_out: Sequence[str], firmware: str) -> RunEnd:
    """Return the end of a run whose requested experiments are all refused by the guard."""
    at = ", ".join(left_out)
    reason = (
        f"Firmware {firmware} has no torque limit, so the palm would stall the thumb at full torque, and the guard "
        "would stop the hand for its current."
    )
    return RunEnd(EndKind.NOT_PERMITTED, at, reason, SafetyStopError(f"{at} not run. {reason}"))


def _failed_gate(results: Mapping[str, Result]) -> Result | None:
    return next((one for name, one in results.items() if EXPERIMENTS[name].gate and failed(one.findings)), None)


def _gentle_allowed(result: Result) -> bool:
    """Return whether a failed gate still permits gentle motion."""
    allowed = EXPERIMENTS[result.recording.header.experiment].gentle_after
    return all(finding.check in allowed for finding in failed(result.findings))
