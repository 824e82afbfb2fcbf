"""What shows the failure of a case, run again on the hand after a step, and compared with before."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from aero.channels import Channel
from aero.errors import AeroError
from aero.safety import SafetyStopError
from hil.checks import EXPERIMENTS
from hil.checks.shared.lateness import VERY_LATE_S
from hil.recordings.recorder import Progress, silent
from hil.targets.target import Target
from hil.verdict.case import DiagnosisCase, Proposal, outcome_of
from hil.verdict.failures import HANDS_FAULT, Failures
from hil.verdict.judge import Judge
from hil.verdict.judged_run import Validation
from hil.verdict.run_end import SAYS_NOTHING, EndKind
from hil.verdict.steps import StepOutcome
from hil.verdict.validation import validate

OPENS_S = 2.0
"""Time in which a hand opens and comes to rest, s."""
HOMINGS = 2
"""How often a hand homes after a step. From where it lies, a thumb finds another zero than from where homing has left
it: of 20 healthy hands 5 failed after they had homed once, 1 after twice, none after three times."""
AT_LEAST = ("presence",)
"""What is run for a failure that no experiment showed, such as a board that is silent from the start."""


def rerun(
    target: Target,
    case: DiagnosisCase,
    proposal: Proposal,
    *,
    freed: bool = False,
    folder: Path | None = None,
    progress: Progress = silent,
) -> tuple[StepOutcome | None, Validation]:
    """Run what shows the failure of a case, and return what became of it after a step; None where that is not known.

    `freed` says that something that touched the hand was taken away for it.

    Raises:
        OSError: a recording cannot be begun.
    """
    judge, again = Judge.of_target(target), case.experiments or AT_LEAST
    # A hand that was not moved, because it failed the first gate, is not opened either.
    moved = any(any(EXPERIMENTS[name].furthest) for name in case.ran)
    _prepare(target, homes=proposal.step.homes, opens=moved)
    run = validate(target, again, folder=folder, from_opening=False, progress=progress)
    outcome = outcome_of_run(judge, case.failed_in(again), proposal, run)
    if outcome is StepOutcome.GONE and not set(case.ran) <= set(again):
        # What fails late, warm or by chance passes in a shorter run: gone is what the whole first run does not show.
        _prepare(target, homes=False, opens=moved)
        run = validate(target, case.ran, folder=folder, from_opening=False, progress=progress)
        outcome = outcome_of_run(judge, case.before, proposal, run)
    return StepOutcome.FREED if freed and outcome is StepOutcome.GONE else outcome, run


def _prepare(target: Target, *, homes: bool, opens: bool) -> None:
    """Let the hand home where a step says so, and open it where it was moved: the first run found it open and at rest.

    What does not let it is no end of the case: the run that follows says what is wrong.
    """
    with suppress(SafetyStopError, AeroError, OSError):
        if homes or opens:
            target.begin(stops=list(Channel))
        for _ in range(HOMINGS if homes else 0):
            target.hand.home()
        if opens:
            target.hand.command_codes([0] * len(Channel))
            target.clock.sleep_until(target.clock.now() + OPENS_S)


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
