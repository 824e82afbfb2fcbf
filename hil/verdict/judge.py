"""Judge of one hand: measures recordings, applies the hand's limits, and diagnoses failures."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from aero.channels import WIRE_ORDER, Channel
from hil.checks import ALIKE, DRIVER, EXPERIMENTS, WHOLE_RUN, Measured, metric_of
from hil.checks.shared.declaration import EvidenceKind, Metric
from hil.checks.shared.experiment import Experiment, Measuring, reading
from hil.checks.shared.lateness import LATE_S, OFTEN, THROUGHOUT, VERY_LATE_S, held_up, longest, part_late
from hil.checks.shared.signals import find_steps, own_stretch
from hil.checks.shared.subjects import CHANNELS
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recording import Header, Recording
from hil.targets.boot_text import identify
from hil.targets.target import Target
from hil.verdict.case import DiagnosisCase, groups_of
from hil.verdict.diagnosis import Diagnosis, NextStep, command_again, command_of_case
from hil.verdict.failures import HANDS_FAULT, Failures
from hil.verdict.findings import Finding, NotJudgedReason, Withheld, failed
from hil.verdict.firmware_version import reads_as
from hil.verdict.judged_run import Result, Validation
from hil.verdict.limits import Limit, compare, load_limits
from hil.verdict.motion import still_channels, without_motion
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.run_end import NO_EVIDENCE, EndKind, RunEnd
from hil.verdict.suspects import THUMB, Isolation, RunSigns, isolate

BAD_S = 0.05
"""Threshold of this computer's scheduling delay, s; above it a stretch counts as busy."""
BUSY_STRETCHES = 3
"""Threshold of the number of busy stretches, or of experiments late throughout; from it the run has no verdict.

A stretch is one channel, or the hand, in one experiment.
"""


SEE_PLOTS = "See the readings and plots of the report, then validate again."
HOME_AGAIN = "Only the travel of the thumb is off: home the hand twice, validate again. If it stays, open the case:"
LOOK_CLOSER = "Switch the supply off, compare the digit's cable and springs with its neighbour's, then look again."
ON_VIRTUAL_TIME = "emulated"
"""Target name of a hand in this process, whose virtual clock waits for the program."""
IN_STEP_S = 0.002
"""Tolerance of the sample period, s; above it a sample counts as late."""


class Judge:
    """Judge for hands with one firmware, guarded or not."""

    def __init__(self, firmware: str, *, guarded: bool) -> None:
        """Load the limits of hands with this firmware and guard state."""
        self._firmware, self._guarded = firmware, guarded
        self.limits: tuple[Limit, ...] = load_limits(firmware, guarded=guarded)

    @classmethod
    def of_target(cls, target: Target) -> Judge:
        """Return the judge of an open hand."""
        return cls(target.firmware, guarded=target.guard is not None)

    @classmethod
    def of_recording(cls, header: Header) -> Judge:
        """Return the judge of a recording's hand."""
        return cls(header.firmware, guarded=bool(header.safety))

    def experiment(self, experiment: Experiment, recording: Recording) -> Result:
        """Measure and judge one experiment; a recording that cannot be measured fails."""
        try:
            measured = experiment.measure(recording)
        except CannotBeMeasuredError as error:
            return Result(recording, {}, (_not_measured(experiment.name, str(error)),))
        return self._compared(experiment, recording, measured)

    def link(self, session: Recording) -> Result:
        """Judge the link by the bytes of a whole session."""
        judged = self._compared(WHOLE_RUN, session, WHOLE_RUN.measure(session))
        return judged if session.wire else _without_bytes(judged)

    def driver(self, run: Validation) -> Result | None:
        """Judge driver and map by the bytes of all experiments and between them; None if no experiment began.

        Aborted experiments count too, because the guard stops many hands for a driver's mistake.
        """
        cut = () if run.end.kind in NO_EVIDENCE else run.end.cut
        recordings = [*(result.recording for result in run.results.values()), *cut]
        if not recordings:
            return None
        between = [] if run.whole_run is None else [run.whole_run.recording]
        every = (*recordings, *between)
        judged = self._compared(DRIVER, recordings[-1], _worst([DRIVER.measure(recording) for recording in every]))
        return judged if all(recording.wire for recording in every) else _without_bytes(judged)

    def alike(self, results: Mapping[str, Result]) -> Result | None:
        """Judge the channels of one hand against each other; None if no reading compares them."""
        measured = ALIKE.measure({name: _on_time(EXPERIMENTS[name], result) for name, result in results.items()})
        if not any(measured.values()):
            return None
        return self._compared(ALIKE, list(results.values())[-1].recording, measured)

    def _compared(self, measuring: Measuring, recording: Recording, measured: Measured) -> Result:
        # lateness of this computer does not affect bytes or comparisons between experiments
        late = _lateness(measuring, recording) if isinstance(measuring, Experiment) else _never_late
        late_samples = _late_samples(measuring, recording) if isinstance(measuring, Experiment) else None
        findings, withheld = compare(measuring, measured, self.limits, late, late_samples)
        return Result(recording, measured, findings, (*withheld, *self._without_limit(measuring, measured)))

    def _without_limit(self, measuring: Measuring, measured: Measured) -> Iterator[Withheld]:
        """Yield the readings that should be judged but have no limit for this hand."""
        own = [limit for limit in self.limits if limit.experiment == measuring.name]
        known = {(limit.metric, subject) for limit in own for subject in limit.subjects}
        for metric in measuring.metrics:
            meant = any(not bound.firmware or self._firmware in bound.firmware for bound in metric.bounds)
            for subject in metric.subjects if meant else ():
                if (metric.name, subject) not in known and reading(measured, subject, metric.name) is not None:
                    yield Withheld(measuring.name, metric.name, subject, metric.words, NotJudgedReason.NO_LIMIT)

    def judged(self, run: Validation, folder: Path | None = None) -> Validation:
        """Return the run with judged experiments and session, and with the findings about the run as a whole.

        Args:
            run: the run.
            folder: folder of the run's case; None for the latest run's.
        """
        run = replace(run, driver=self.driver(run), alike=self.alike(run.results))
        run = _busy(without_motion(run, still_channels(run.numbers, self.limits)))
        return run if run.passed else replace(run, diagnosis=self.diagnosis(run, folder))

    def diagnosis(self, run: Validation, folder: Path | None = None) -> Diagnosis:
        """Return the diagnosis of a run's failures.

        After an interruption or a refusal of the guard, nothing is suspected.
        """
        failures = failed(run.findings)
        if run.end.kind in NO_EVIDENCE or run.end.kind is EndKind.NOT_PERMITTED:
            return Diagnosis(unexplained=failures, step=_again(run))
        readings = tuple(f for name, result in run.judged.items() if not _asks(name) for f in failed(result.findings))
        if answers := failed(run.answers):
            if not readings:
                return _answered(run, answers)
        elif not readings and run.end.error is None:
            return Diagnosis(unexplained=failures, step=_action(run))
        signs = self.signs_of(run)
        found = isolate(signs)
        # A stop before the first sample leaves no recording, but the stopped experiment still shows the failure.
        ended = (run.end.at,) if run.end.kind in HANDS_FAULT and run.end.at in EXPERIMENTS else ()
        ran = tuple(dict.fromkeys((*run.results, *(cut.header.experiment for cut in run.end.cut), *ended)))
        groups = groups_of(found, signs.failures)
        case = DiagnosisCase(groups, ran, run.planned or ran)
        if not groups:
            # the end of the run explains itself
            return Diagnosis(unexplained=failures, step=_action(run))
        return _told(run, case, found, folder)

    def signs_of(self, run: Validation) -> RunSigns:
        """Return the input of the rules, without withheld readings."""
        numbers = {name: without_withheld(measured, name, run.withheld) for name, measured in run.numbers.items()}
        return replace(self.signs(numbers, run.end), silent=_silent_at_start(run))

    def signs(self, numbers: Mapping[str, Measured], end: RunEnd) -> RunSigns:
        """Return the input of the rules from the readings that are to be judged."""
        numbers = {name: measured for name, measured in numbers.items() if not _asks(name)}
        another = reads_as(numbers, self._firmware, guarded=self._guarded)
        return RunSigns(Failures.of(numbers, self.limits, end).by_fault, end, another)


Late = Callable[[str, Metric], float]
"""Scheduling delay, s, that affected a metric of a subject."""


def _late_samples(measuring: Experiment, recording: Recording) -> NotJudgedReason | None:
    """Return the reason why samples of a recording may be late, or None if all were on time."""
    if recording.header.target != ON_VIRTUAL_TIME or recording.delays:
        return NotJudgedReason.LATE_THROUGHOUT
    # In virtual time only the link, or a plan of delays, makes samples late.
    late = np.diff(recording["codes"].times) > measuring.period_s + IN_STEP_S
    return NotJudgedReason.LATE_SAMPLES if late.any() else None


def _without_bytes(judged: Result) -> Result:
    """Return the judged bytes where some recording has none: failures stay, passes become unknown."""
    unknown = [
        Withheld(one.experiment, one.check, one.subject, one.name, NotJudgedReason.NO_BYTES)
        for one in judged.findings
        if one.passed
    ]
    return replace(judged, findings=failed(judged.findings), withheld=(*judged.withheld, *unknown))


def _never_late(_subject: str, _metric: Metric) -> float:
    return 0.0


def _lateness(measuring: Experiment, recording: Recording) -> Late:
    """Return a function for the scheduling delay of this computer during a subject's metric, s."""
    stretches = held_up(recording, measuring.period_s)
    commands = recording.series.get("command", recording.series.get("command_codes"))
    steps = [] if commands is None else find_steps(commands.times, commands.values)
    often_s = max(longest(stretches, 0.0, math.inf), LATE_S) if part_late(recording) > OFTEN else 0.0

    def late(subject: str, metric: Metric) -> float:
        if often_s and metric.timed:
            return often_s
        if not stretches:
            return 0.0
        which = metric.seconds or measuring.seconds
        own = None if which or subject not in CHANNELS else own_stretch(steps, CHANNELS.index(subject))
        seconds = longest(stretches, *(own or (0.0, math.inf)))
        return seconds if seconds > (LATE_S if metric.timed else VERY_LATE_S) else 0.0

    return late


def _on_time(experiment: Experiment, result: Result) -> Measured:
    """Return the readings of an experiment that no scheduling delay of this computer affects."""
    late = _lateness(experiment, result.recording)

    def on_time(subject: str, name: str) -> bool:
        metric = metric_of(experiment.name, name, subject)
        return metric is None or not late(subject, metric)

    return {
        subject: {name: value for name, value in row.items() if on_time(subject, name)}
        for subject, row in result.measured.items()
    }


def _busy(run: Validation) -> Validation:
    """Return the run with a HOST_BUSY end if scheduling delays were too frequent and nothing else is wrong."""
    stretches = {(one.experiment, one.subject) for one in run.withheld if one.held_up_s > BAD_S}
    throughout = sorted(name for name, result in run.results.items() if part_late(result.recording) > THROUGHOUT)
    if not run.passed or max(len(stretches), len(throughout)) < BUSY_STRETCHES:
        return run
    if len(stretches) >= BUSY_STRETCHES:
        names, what = sorted({name for name, _ in stretches}), f"{len(stretches)} stretches were not judged"
    else:
        names, what = throughout, f"no time in {len(throughout)} experiments can be judged"
    reason = f"{what}: this computer was held up."
    return replace(run, end=RunEnd(EndKind.HOST_BUSY, ", ".join(names), reason))


def without_withheld(measured: Measured, experiment: str, withheld: Sequence[Withheld]) -> Measured:
    """Return the readings without the withheld ones."""
    left_out = {(one.subject, one.metric) for one in withheld if one.experiment == experiment}
    return {
        subject: {metric: value for metric, value in metrics.items() if (subject, metric) not in left_out}
        for subject, metrics in measured.items()
    }


def _asks(name: str) -> bool:
    return name in EXPERIMENTS and EXPERIMENTS[name].asks


def _told(run: Validation, case: DiagnosisCase, found: Isolation, folder: Path | None) -> Diagnosis:
    """Return the diagnosis of a case: its suspects, with their clues and findings."""
    bare = Diagnosis(case.remaining)
    explained = {key for group in case.opened for key in group.before.off}

    def speaks(finding: Finding) -> bool:
        return (finding.experiment, finding.check, finding.subject) in explained or finding == run.end.finding

    off = failed(run.findings)
    return replace(
        bare,
        clues=tuple(clue.seen for clue in found.clues),
        evidence=tuple(finding for finding in off if speaks(finding)),
        unexplained=tuple(finding for finding in off if not speaks(finding)),
        case=case,
        step=_step(run, case, folder),
    )


def _step(run: Validation, case: DiagnosisCase, folder: Path | None) -> NextStep:
    """Return the next step of a case; for a thumb that may have homed badly, the homing that precedes any case."""
    if run.end.error is None and run.header is not None and homed_badly(case.before):
        return NextStep(HOME_AGAIN, command_of_case(run.header, folder))
    if (proposal := case.next_step) is None:
        return _action(run)
    return NextStep(proposal.text, command_of_case(run.header, folder))


def homed_badly(failures: Failures) -> bool:
    """Return whether only travel of the thumb is off, as after a homing that ended short of a stop."""
    thumb = {channel.label for channel in THUMB}
    return bool(failures.pieces) and all(
        piece.kind is EvidenceKind.TRAVEL and piece.subject in thumb for piece in failures.pieces
    )


def _silent_at_start(run: Validation) -> tuple[Channel, ...]:
    """Return the channels whose servos were silent at startup, according to the recorded boot texts."""
    texts = [str(one.recording.header.parameters.get("boot_text", "")) for one in run.results.values()]
    return tuple(sorted({WIRE_ORDER[number] for text in texts for number in identify(text).silent}))


def _action(run: Validation) -> NextStep:
    """Return the action after a run without suspects, or whose case has no step left."""
    end = run.end.finding
    return NextStep(SEE_PLOTS if end is None or not end.remedy else end.remedy)


def _again(run: Validation) -> NextStep | None:
    """Return the action after an inconclusive run."""
    if run.end.finding is None or run.header is None:
        return None
    return NextStep(run.end.finding.remedy, command_again(run.header))


def _answered(run: Validation, answers: Sequence[Finding]) -> Diagnosis:
    """Return the diagnosis of the user's answers in a run without failed readings."""
    seen = tuple(channel for channel in Channel if any(finding.subject == channel.label for finding in answers))
    suspects = tuple(Suspect(Part.DIGIT, channel) for channel in seen)
    step = NextStep(LOOK_CLOSER, command_again(run.header) if run.header else "")
    return Diagnosis(suspects, ("it looks different from a healthy hand",), evidence=tuple(answers), step=step)


def _worst(measured: Sequence[Measured]) -> Measured:
    return {
        subject: {name: max(one[subject][name] for one in measured) for name in metrics}
        for subject, metrics in measured[0].items()
    }


def _not_measured(name: str, reason: str) -> Finding:
    return Finding(
        check=name,
        subject="hand",
        passed=False,
        measured="not measurable",
        expected="measured",
        source="the recording",
        meaning=f"The hand did not move in a way that can be measured: {reason}.",
        experiment=name,
        excess=None,
    )
