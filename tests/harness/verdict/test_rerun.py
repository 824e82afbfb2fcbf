"""What a case runs again shows the failure on the same hand; and is gone where the hand was mended."""

from dataclasses import replace

import pytest
from drawn import drawn

from aero.channels import Channel
from aero.protocol import Opcode
from hil.emulated.any_hand import open_target
from hil.emulated.faults import CATALOGUE, parse_fault
from hil.targets.hand_errors import FaultNeverFiredError
from hil.verdict.case import DiagnosisCase
from hil.verdict.failures import Failures
from hil.verdict.group import AmbiguityGroup, Proposal
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.rerun import Plan, rerun
from hil.verdict.steps import StepOutcome, steps
from hil.verdict.validation import validate

GENTLE = ("presence", "audit")
SHORT = ["motor_dead:ring", "winding_reversed:ring", "reply_lost=0.3", "gear_jammed:thumb_flexor"]
ENDING = ["servo_silent", "link_silent", "link_hangs_up", "reply_stale"]
DRAWN = ["calibrated_mid", "calibrated_mid_and_homed", "boot_text", "board_restart", "board_hangs", "reply_junk"]
"""What happens once, or by chance, so that it may show less when it is run again; what else runs shows what it did."""
SOME = frozenset({Suspect(Part.USB), Suspect(Part.BOARD)})
AGAIN = Proposal(steps()["again"])


@pytest.mark.parametrize("fault", drawn(SHORT, 2))
def test_what_is_run_again_fails_on_the_same_hand(fault):
    """Advice that passes on the broken hand is a defect: so was `validate --only audit` of a wrongly wound cable."""
    with open_target(faults=[parse_fault(fault)]) as target:
        case = validate(target, ("presence", "audit", "excursion")).diagnosis.case
        outcomes, run = rerun(target, case, AGAIN)
    assert {*outcomes} == {StepOutcome.STAYS}
    assert not run.passed


@pytest.mark.parametrize("name", drawn([*ENDING, *DRAWN], 1))
def test_what_a_default_run_finds_fails_again(name):
    """No case may begin with what passes on the broken hand."""
    fault = CATALOGUE[name]
    channels = [one for one in (Channel.RING, Channel.THUMB_CMC_FLEXION, *fault.channels) if one in fault.channels]
    injection = fault.at(fault.steps()[-1], next(iter(channels), None))
    try:
        with open_target(faults=[injection]) as target:
            found = validate(target)
            if (case := found.diagnosis.case) is None:
                pytest.skip("a default run finds nothing that tells about a part")
            outcomes, run = rerun(target, case, AGAIN)
    except FaultNeverFiredError:
        pytest.skip("nothing came its way")
    assert {*outcomes} & ({StepOutcome.STAYS, StepOutcome.PARTLY} if name in DRAWN else {StepOutcome.STAYS})
    assert not run.passed


@pytest.mark.parametrize(("ran", "expected"), [(("presence",), StepOutcome.GONE), (GENTLE, StepOutcome.PARTLY)])
def test_gone_is_what_the_whole_first_run_does_not_show(ran, expected):
    """A cable that frayed with time passed the shorter run, and homing was believed to have mended it."""
    with open_target(faults=[parse_fault("motor_dead:ring")]) as target:
        case = validate(target, GENTLE).diagnosis.case
        failed = AmbiguityGroup(Failures({("presence", "round_trip", "hand"): 99.0}), frozenset({Suspect(Part.USB)}))
        outcomes, _ = rerun(target, replace(case, opened=(failed,), planned=ran), AGAIN)
    assert {*outcomes} == {expected}


def test_nothing_is_gone_while_another_check_fails():
    """The command ended with 0 once beside "elsewhere 1 checks fail still"."""
    with open_target(homed=True, faults=[parse_fault("motor_dead:ring")]) as target:
        case = validate(target, ["audit"]).diagnosis.case
    with open_target(homed=True, faults=[parse_fault("motor_dead:index")]) as target:
        outcomes, run = rerun(target, case, AGAIN)
    assert StepOutcome.PARTLY in outcomes
    assert not run.passed


def test_a_mended_hand_shows_it_no_more():
    with open_target(homed=True, faults=[parse_fault("motor_dead:ring")]) as target:
        case = validate(target, GENTLE).diagnosis.case
    with open_target(homed=True) as target:
        outcomes, run = rerun(target, case, Proposal(steps()["home"]))
    assert {*outcomes} == {StepOutcome.GONE}
    assert run.passed


def test_a_hand_that_the_guard_does_not_let_home_fails_again():
    """It ended the case once: a finger whose motor was dead stood where homing had found it."""
    with open_target(guarded=True, faults=[parse_fault("motor_runaway:ring")]) as target:
        case = validate(target, GENTLE).diagnosis.case
    with open_target(guarded=True, faults=[parse_fault("motor_runaway:ring")]) as target:
        outcomes, run = rerun(target, case, Proposal(steps()["home"]))
    assert {*outcomes} == {StepOutcome.STAYS}
    assert not run.passed


@pytest.mark.parametrize(
    ("ran", "step", "homings", "moves"),
    [(("presence",), "again", 0, False), (GENTLE, "again", 0, True), (GENTLE, "home", 2, True)],
)
def test_a_hand_that_was_not_moved_is_not_opened_and_one_that_homes_does_so_twice(ran, step, homings, moves):
    """A hand that fails the first gate is not moved further; homed once, a thumb may have a wrong zero."""
    failed = Failures({("presence", "distinct_readings", "hand"): -3.0})
    with open_target(homed=True) as target:
        mark = target.wire.mark()
        rerun(target, DiagnosisCase((AmbiguityGroup(failed, SOME),), ran, ran), Proposal(steps()[step]))
        sent = [one.data[0] for one in target.wire.since(mark, 0.0) if one.direction == "to_hand"]
    until_presence = sent[: sent.index(Opcode.GET_POS)]
    assert until_presence.count(Opcode.HOMING) == homings
    assert (Opcode.CTRL_POS in until_presence) is moves


@pytest.mark.parametrize(
    ("off", "confirming"),
    [
        ({("audit", "followed", "ring"): -9.0}, (("audit",), ("presence", "audit"))),
        ({("audit", "followed", "ring"): -9.0, ("audit", "pull", "ring"): 3.0}, (("presence", "audit"),)),
    ],
)
def test_a_failure_that_may_be_chance_has_to_stay_away_in_one_more_run(off, confirming):
    """Every twentieth reply was another one; a run without such a reply convicted the computer."""
    case = DiagnosisCase((AmbiguityGroup(Failures(off), SOME),), ("audit",), ("presence", "audit"))
    plan = Plan.after(case, steps()["cable"], "0.2.0")
    assert plan.confirming == confirming
    assert plan.seconds > plan.first_s


def test_the_announced_time_holds_the_second_homing():
    """A step took 385 s of the announced 190 s: part of the failure stayed, and the hand homed and ran once more."""
    case = DiagnosisCase(
        (AmbiguityGroup(Failures({("audit", "followed", "ring"): -9.0}), SOME),), ("audit",), ("audit",)
    )
    home, again = (Plan.after(case, steps()[name], "0.2.0") for name in ("home", "again"))
    assert home.seconds - 2 * home.first_s == again.seconds - again.first_s
