"""Rerun of the failing experiments on the hand after a step, compared with the first run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from aero.channels import Channel
from aero.errors import AeroError
from aero.firmware import firmware_of
from aero.protocol import MAX_CODE
from aero.safety import SafetyStopError
from aero.safety.interrupts import stops_let_through
from hil.checks import ALIKE, EXPERIMENTS
from hil.checks.shared.declaration import EvidenceKind
from hil.checks.shared.lateness import VERY_LATE_S
from hil.targets.hand_spec import HOMINGS
from hil.targets.target import Target
from hil.verdict.case import DiagnosisCase
from hil.verdict.failures import HANDS_FAULT, Piece
from hil.verdict.findings import failed
from hil.verdict.group import CaseState, Proposal
from hil.verdict.judge import Judge
from hil.verdict.judged_run import Validation
from hil.verdict.outcome import failed_in, outcome_of
from hil.verdict.run_end import NO_EVIDENCE, EndKind
from hil.verdict.steps import CaseStep, StepOutcome
from hil.verdict.validation import validate

Outcomes = tuple[StepOutcome, ...]
"""Outcome of a step for each group of a case."""
NUDGE, NUDGES, NUDGE_S = 0.12, 3, 0.6
"""Nudge of a channel: fraction of its window, repetitions, time at each position (s)."""
OPENS_S = 2.0
"""Time for a hand to open and settle, s."""
WARM_RUNS = 2
"""Number of further runs for a failure that needs warm servos."""
AT_LEAST = ("presence",)
"""Experiments for a failure that no experiment showed, such as a board that is silent from the start."""


CaseProgress = Callable[[float, str, float], None]
"""Callback with the progress after a step (0 to 1), the current action, and the remaining time, s."""


@dataclass(frozen=True)
class Plan:
    """Program actions after a step."""

    first: tuple[str, ...]
    """Experiments that reproduce the failure."""
    confirming: tuple[tuple[str, ...], ...]
    """Runs that confirm a pass of `first`: the same again for a failure by chance, then all of the original run."""
    homings: int
    homing_s: float
    """Time of one homing, s."""
    opens: bool
    """Whether the hand is opened before a run."""

    @classmethod
    def after(cls, case: DiagnosisCase, step: CaseStep, firmware: str) -> Plan:
        """Return the program actions after a step of a case, for a hand with this firmware."""
        first = case.experiments or AT_LEAST
        whole = set(case.planned) - set(first)
        confirming = [first] * case.by_chance + [case.planned] * bool(whole)
        # a servo that has cooled down passes at first
        warm = any(piece.kind is EvidenceKind.OWN_SENSOR for piece in case.before.pieces)
        confirming += [case.planned] * (WARM_RUNS * warm)
        # a hand that failed the first gate was never moved and needs no opening
        moved = any(any(EXPERIMENTS[name].furthest) for name in case.ran)
        return cls(first, tuple(confirming), HOMINGS if step.homes else 0, firmware_of(firmware).homing_s, moved)

    @property
    def furthest(self) -> tuple[float, ...]:
        """Largest commanded fraction of each channel's window, (7,), command order."""
        each = zip(*(EXPERIMENTS[name].furthest for name in {*self.first, *chain(*self.confirming)}), strict=True)
        return tuple(map(max, each))

    @property
    def homes_s(self) -> float:
        """Time of all homings, s."""
        return self.homings * self.homing_s

    @property
    def opens_s(self) -> float:
        """Time of one opening, s."""
        return OPENS_S if self.opens else 0.0

    @property
    def first_s(self) -> float:
        """Hand time until the failing experiments have run, s."""
        return self.homes_s + self.opens_s + sum(EXPERIMENTS[name].hand_s for name in self.first)

    @property
    def seconds(self) -> float:
        """Upper bound of the hand time, s. After an incomplete homing, homing and failing experiments run once more."""
        each_s = (self.opens_s + sum(EXPERIMENTS[name].hand_s for name in run) for run in self.confirming)
        return self.first_s * (2 if self.homings else 1) + sum(each_s)


class _Course:
    """Progress of a plan."""

    def __init__(self, plan: Plan, tell: CaseProgress) -> None:
        self._whole_s, self._tell = plan.seconds, tell
        self._done_s = 0.0

    def within(self, hand_s: float, done: float, doing: str) -> None:
        """Report progress within a part of `hand_s`, of which the fraction `done` is finished."""
        at_s = min(self._done_s + done * hand_s, self._whole_s)
        self._tell(at_s / self._whole_s, doing, self._whole_s - at_s)

    def past(self, hand_s: float) -> None:
        """Mark a part of the plan as finished."""
        self._done_s += hand_s


def rerun(
    target: Target,
    case: DiagnosisCase,
    proposal: Proposal,
    *,
    freed: bool = False,
    folder: Path | None = None,
    baseline: Path | None = None,
    progress: CaseProgress = lambda _part, _doing, _left_s: None,
) -> tuple[Outcomes | None, Validation]:
    """Rerun the failing experiments of a case after a step; return the outcome of each group, and the run.

    The outcomes are None if the run is inconclusive. A step that homes does so again if part of a failure stays: the
    board finishes with its next homing what the step has started. `freed` is True if the user removed an object in
    contact with the hand. `baseline` is a folder as for `validate`.

    Raises:
        OSError: a recording cannot be created.
    """
    judge, plan = Judge.of_target(target), Plan.after(case, proposal.step, target.firmware)
    course = _Course(plan, progress)
    _prepare(target, plan, plan.homings, course)
    run = _run(target, plan.first, folder, baseline, course)
    outcomes = outcomes_of_run(judge, case, plan.first, proposal, run)
    if plan.homings and outcomes and StepOutcome.PARTLY in outcomes:
        _prepare(target, plan, plan.homings, course)
        run = _run(target, plan.first, folder, baseline, course)
        outcomes = outcomes_of_run(judge, case, plan.first, proposal, run)
    for names in plan.confirming:
        # Late, thermal or random faults can pass a shorter run, and chance a whole one.
        if outcomes and StepOutcome.GONE in outcomes:
            _prepare(target, plan, 0, course)
            run = _run(target, names, folder, baseline, course)
            again = outcomes_of_run(judge, case, names, proposal, run)
            outcomes = again and tuple(
                new if one is StepOutcome.GONE else one for one, new in zip(outcomes, again, strict=True)
            )
    if outcomes and {*outcomes} == {StepOutcome.GONE} and _fails(run) and not _left_elsewhere(case):
        outcomes = (StepOutcome.PARTLY,) * len(outcomes)
    progress(1.0, "done", 0.0)
    if freed and outcomes:
        outcomes = tuple(StepOutcome.FREED if one is StepOutcome.GONE else one for one in outcomes)
    return outcomes, run


def nudge(target: Target, channel: Channel) -> None:
    """Move one channel of an open hand a little, some times, for a person who watches.

    Raises:
        AeroError, OSError, SafetyStopError: as commands of the hand.
    """
    target.begin()
    for part in (NUDGE, 0.0) * NUDGES:
        target.hand.command_codes([round(part * MAX_CODE) if one is channel else 0 for one in Channel])
        target.clock.sleep_until(target.clock.now() + NUDGE_S)


def _left_elsewhere(case: DiagnosisCase) -> bool:
    """Return whether a convicted part is still in the hand, where it makes other checks fail."""
    return any(one.state is CaseState.CONVICTED and not one.gone for one in case.groups)


def _fails(run: Validation) -> bool:
    """Return whether a check failed, ignoring a busy computer and the temperatures of a hand warmed up by the run."""
    busy = run.end.finding if run.end.kind not in HANDS_FAULT else None
    warmed_up = ALIKE.name, "temperature"
    return any(one != busy and (one.experiment, one.check) != warmed_up for one in failed(run.findings))


def _run(
    target: Target, names: Sequence[str], folder: Path | None, baseline: Path | None, course: _Course
) -> Validation:
    left = list(names)

    def result(_so_far: Validation) -> None:
        course.past(EXPERIMENTS[left.pop(0)].hand_s)

    def within(done: float, doing: str) -> None:
        course.within(EXPERIMENTS[left[0]].hand_s, done, f"{left[0]}: {doing}")

    return validate(
        target, names, baseline=baseline, folder=folder, from_opening=False, progress=within, on_result=result
    )


def _prepare(target: Target, plan: Plan, homings: int, course: _Course) -> None:
    """Home the hand if the step requires it, and open it if it was moved, as at the start of the first run.

    Errors are ignored here; the run that follows reports them.
    """
    with stops_let_through(), suppress(SafetyStopError, AeroError, OSError):
        if homings or plan.opens:
            target.begin(stops=list(Channel))
        for _ in range(homings):
            course.within(plan.homing_s, 0.0, "homing")
            target.hand.home()
            course.past(plan.homing_s)
        if plan.opens:
            course.within(OPENS_S, 0.0, "opening")
            target.hand.command_codes([0] * len(Channel))
            target.clock.sleep_until(target.clock.now() + OPENS_S)
            course.past(OPENS_S)


def outcomes_of_run(
    judge: Judge, case: DiagnosisCase, experiments: Sequence[str], proposal: Proposal, run: Validation
) -> Outcomes | None:
    """Return the outcome of a step for each group, from the run of some experiments after it.

    None if the run is inconclusive for each group that goes on; UNSURE for a group about which the run says nothing.
    """
    # After a busy run without failures, the gone failure was still measured again.
    if run.end.kind in NO_EVIDENCE - {EndKind.HOST_BUSY}:
        return None
    # A busy computer loses replies too, so failures of such a run do not show that the step was useless. A lost link
    # delays the program itself and is excluded.
    late = any(one.held_up_s > VERY_LATE_S for one in run.withheld)
    if late and not run.passed and run.end.kind not in HANDS_FAULT | {EndKind.HOST_BUSY}:
        return None
    after = judge.signs_of(run).failures
    found = [outcome_of(failed_in(one.before, experiments), after, proposal) for one in case.groups]
    going_on = [outcome for one, outcome in zip(case.groups, found, strict=True) if one.state is CaseState.GOES_ON]
    if all(outcome is None for outcome in going_on or found):
        return None
    return tuple(outcome or StepOutcome.UNSURE for outcome in found)


def recurring(case: DiagnosisCase, run: Validation) -> frozenset[Piece]:
    """Return the pieces of evidence of a case that recur in a run, or that it did not measure."""
    if run.header is None:
        return case.before.pieces
    after = Judge.of_recording(run.header).signs_of(run).failures
    before = case.before
    return before.recurring(after) | {one for one in before.pieces if one[:2] not in after.measured}
