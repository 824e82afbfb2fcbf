"""What shows the failure of a case, run again on the hand after a step, and compared with before."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from aero.channels import Channel
from aero.errors import AeroError
from aero.firmware import firmware_of
from aero.safety import SafetyStopError
from hil.checks import EXPERIMENTS
from hil.checks.shared.lateness import VERY_LATE_S
from hil.targets.hand_spec import HOMINGS
from hil.targets.target import Target
from hil.verdict.case import DiagnosisCase, Proposal, outcome_of
from hil.verdict.failures import HANDS_FAULT, Failures
from hil.verdict.judge import Judge
from hil.verdict.judged_run import Validation
from hil.verdict.run_end import SAYS_NOTHING, EndKind
from hil.verdict.steps import CaseStep, StepOutcome
from hil.verdict.validation import validate

OPENS_S = 2.0
"""Time in which a hand opens and comes to rest, s."""
AT_LEAST = ("presence",)
"""What is run for a failure that no experiment showed, such as a board that is silent from the start."""


CaseProgress = Callable[[float, str, float], None]
"""Takes the finished part of all that follows a step, 0 to 1, what is being done, and the time left, s."""


@dataclass(frozen=True)
class Plan:
    """All that follows a step."""

    first: tuple[str, ...]
    """Experiments that show the failure."""
    more: tuple[str, ...]
    """All that the first run would have done, which follows if those pass; empty if they are all."""
    homings: int
    homing_s: float
    """Time of one homing, s."""
    opens: bool
    """Whether the hand is opened before a run."""

    @classmethod
    def after(cls, case: DiagnosisCase, step: CaseStep, firmware: str) -> Plan:
        """Return what follows a step of a case on a hand with this firmware."""
        first = case.experiments or AT_LEAST
        more = case.planned if set(case.planned) - set(first) else ()
        # A hand that was not moved, because it failed the first gate, is not opened either.
        moved = any(any(EXPERIMENTS[name].furthest) for name in case.ran)
        return cls(first, more, HOMINGS if step.homes else 0, firmware_of(firmware).homing_s, moved)

    @property
    def furthest(self) -> tuple[float, ...]:
        """Part of each channel's window that a run sends it to at most, (7,), command order."""
        each = zip(*(EXPERIMENTS[name].furthest for name in (*self.first, *self.more)), strict=True)
        return tuple(map(max, each))

    @property
    def homes_s(self) -> float:
        """Time of all homing, s."""
        return self.homings * self.homing_s

    @property
    def opens_s(self) -> float:
        """Time of one opening, s."""
        return OPENS_S if self.opens else 0.0

    @property
    def first_s(self) -> float:
        """Hand time until what shows the failure has run, s."""
        return self.homes_s + self.opens_s + sum(EXPERIMENTS[name].hand_s for name in self.first)

    @property
    def seconds(self) -> float:
        """Hand time of all, s."""
        more_s = sum(EXPERIMENTS[name].hand_s for name in self.more)
        return self.first_s + (self.opens_s + more_s if self.more else 0.0)


class _Course:
    """How far a plan has got."""

    def __init__(self, plan: Plan, tell: CaseProgress) -> None:
        self._whole_s, self._tell = plan.seconds, tell
        self._done_s = 0.0

    def within(self, hand_s: float, done: float, doing: str) -> None:
        """Tell of a part of the plan that takes `hand_s` and of which a share is done."""
        at_s = min(self._done_s + done * hand_s, self._whole_s)
        self._tell(at_s / self._whole_s, doing, self._whole_s - at_s)

    def past(self, hand_s: float) -> None:
        """Note that a part of the plan is done."""
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
    """Run what shows the failure of a case, and return what became of it after a step; None where that is not known.

    `freed` says that something that touched the hand was taken away for it.

    Raises:
        OSError: a recording cannot be begun.
    """
    judge, plan = Judge.of_target(target), Plan.after(case, proposal.step, target.firmware)
    course = _Course(plan, progress)
    _prepare(target, plan, plan.homings, course)
    run = _run(target, plan.first, folder, course)
    outcome = outcome_of_run(judge, case.failed_in(plan.first), proposal, run)
    if outcome is StepOutcome.GONE and plan.more:
        # What fails late, warm or by chance passes in a shorter run: gone is what the whole first run does not show.
        _prepare(target, plan, 0, course)
        run = _run(target, plan.more, folder, course)
        outcome = outcome_of_run(judge, case.before, proposal, run)
    progress(1.0, "done", 0.0)
    return StepOutcome.FREED if freed and outcome is StepOutcome.GONE else outcome, run


def _run(target: Target, names: Sequence[str], folder: Path | None, course: _Course) -> Validation:
    left = list(names)

    def result(_so_far: Validation) -> None:
        course.past(EXPERIMENTS[left.pop(0)].hand_s)

    def within(done: float, doing: str) -> None:
        course.within(EXPERIMENTS[left[0]].hand_s, done, f"{left[0]}: {doing}")

    return validate(target, names, folder=folder, from_opening=False, progress=within, on_result=result)


def _prepare(target: Target, plan: Plan, homings: int, course: _Course) -> None:
    """Let the hand home where a step says so, and open it where it was moved: the first run found it open and at rest.

    What does not let it is no end of the case: the run that follows says what is wrong.
    """
    with suppress(SafetyStopError, AeroError, OSError):
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
    """Return what became of failures in a run after a step; None where the run says nothing about the hand."""
    # Where nothing failed on a busy computer, what is gone was still measured again.
    if run.end.kind in SAYS_NOTHING - {EndKind.HOST_BUSY}:
        return None
    # A computer that is held up loses replies, too: what fails then is no sign that the step mended nothing.
    # A link that ended was waited for, and holds the program up itself.
    late = any(one.held_up_s > VERY_LATE_S for one in run.withheld)
    if late and not run.passed and run.end.kind not in HANDS_FAULT | {EndKind.HOST_BUSY}:
        return None
    return outcome_of(before, judge.signs_of(run).failures, proposal)
