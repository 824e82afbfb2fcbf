"""What a case runs again shows the failure on the same hand; and is gone where the hand was mended."""

import pytest

from hil.faults import parse_fault
from hil.targets.opening import open_target
from hil.verdict.case import Proposal
from hil.verdict.rerun import rerun
from hil.verdict.steps import StepOutcome, steps
from hil.verdict.validation import validate

GENTLE = ("presence", "audit")
SHORT = ["motor_dead:ring", "winding_reversed:ring", "reply_lost=0.3", "gear_jammed:thumb_flexor"]
AGAIN = Proposal(steps()["again"])


@pytest.mark.parametrize("fault", SHORT)
def test_what_is_run_again_fails_on_the_same_hand(fault):
    """Advice that passes on the broken hand is a defect: so was `validate --only audit` of a wrongly wound cable."""
    with open_target(homed=True, faults=[parse_fault(fault)]) as target:
        case = validate(target, ("presence", "audit", "excursion")).diagnosis.case
        assert set(case.experiments) <= {"presence", "audit", "excursion"}
        outcome, run = rerun(target, case, AGAIN)
    assert outcome is StepOutcome.STAYS
    assert not run.passed


def test_a_mended_hand_shows_it_no_more():
    with open_target(homed=True, faults=[parse_fault("motor_dead:ring")]) as target:
        case = validate(target, GENTLE).diagnosis.case
    with open_target(homed=True) as target:
        outcome, run = rerun(target, case, Proposal(steps()["home"]))
    assert outcome is StepOutcome.GONE
    assert run.passed
