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
from aero.safety import SafetyStopError
from aero.safety.interrupts import stops_let_through
from hil.checks import ALIKE, EXPERIMENTS
from hil.checks.shared.lateness import VERY_LATE_S
from hil.targets.hand_spec import HOMINGS
from hil.targets.target import Target
from hil.verdict.case import DiagnosisCase, Proposal, outcome_of
from hil.verdict.failures import HANDS_FAULT, Failures
from hil.verdict.findings import failed
from hil.verdict.judge import Judge
from hil.verdict.judged_run import Validation
from hil.verdict.run_end import SAYS_NOTHING, EndKind
from hil.verdict.steps import CaseStep, StepOutcome
from hil.verdict.validation import validate

OPENS_S = 2.0
"""Time for a hand to open and settle, s."""
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
        """Total hand time, s."""
        each_s = (self.opens_s + sum(EXPERIMENTS[name].hand_s for name in run) for run in self.confirming)
        return self.first_s + sum(each_s)


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
    progress: CaseProgress = lambda _part, _doing, _left_s: None,
) -> tuple[StepOutcome | None, Validation]:
    """Rerun the failing experiments of a case after a step; return the outcome (None if inconclusive) and the run.

    `freed` is True if the user removed an object in contact with the hand.

    Raises:
        OSError: a recording cannot be created.
    """
    judge, plan = Judge.of_target(target), Plan.after(case, proposal.step, target.firmware)
    course = _Course(plan, progress)
    _prepare(target, plan, plan.homings, course)
    run = _run(target, plan.first, folder, course)
    outcome = outcome_of_run(judge, case.failed_in(plan.first), proposal, run)
    for names in plan.confirming:
        # Late, thermal or random faults can pass a shorter run, and chance a whole one.
        if outcome is StepOutcome.GONE:
            _prepare(target, plan, 0, course)
            run = _run(target, names, folder, course)
            outcome = outcome_of_run(judge, case.failed_in(names), proposal, run)
    if outcome is StepOutcome.GONE and _fails(run):
        outcome = StepOutcome.PARTLY
    progress(1.0, "done", 0.0)
    return StepOutcome.FREED if freed and outcome is StepOutcome.GONE else outcome, run


def _fails(run: Validation) -> bool:
    """Return whether a check failed, ignoring a busy computer and the temperatures of a hand warmed up by the run."""
    busy = run.end.finding if run.end.kind not in HANDS_FAULT else None
    return any(one != busy and one.experiment != ALIKE.name for one in failed(run.findings))


def _run(target: Target, names: Sequence[str], folder: Path | None, course: _Course) -> Validation:
    left = list(names)

    def result(_so_far: Validation) -> None:
        course.past(EXPERIMENTS[left.pop(0)].hand_s)

    def within(done: float, doing: str) -> None:
        course.within(EXPERIMENTS[left[0]].hand_s, done, f"{left[0]}: {doing}")

    return validate(target, names, folder=folder, from_opening=False, progress=within, on_result=result)


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


def outcome_of_run(judge: Judge, before: Failures, proposal: Proposal, run: Validation) -> StepOutcome | None:
    """Return the outcome of a step from the run after it, or None if the run is inconclusive."""
    # After a busy run without failures, the gone failure was still measured again.
    if run.end.kind in SAYS_NOTHING - {EndKind.HOST_BUSY}:
        return None
    # A busy computer loses replies too, so failures of such a run do not show that the step was useless. A lost link
    # delays the program itself and is excluded.
    late = any(one.held_up_s > VERY_LATE_S for one in run.withheld)
    if late and not run.passed and run.end.kind not in HANDS_FAULT | {EndKind.HOST_BUSY}:
        return None
    return outcome_of(before, judge.signs_of(run).failures, proposal)
