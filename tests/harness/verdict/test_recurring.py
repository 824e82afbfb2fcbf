"""Recurrence of a failure: near its limit it passes by chance, and after a step in doubt it may be gone already."""

from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from hil.checks.shared.declaration import EvidenceKind
from hil.verdict.case import DiagnosisCase
from hil.verdict.failures import EVIDENCE, Failures
from hil.verdict.group import AGAIN, AmbiguityGroup, CaseState, Proposal
from hil.verdict.limits import excesses, load_limits
from hil.verdict.outcome import outcome_of
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.steps import StepOutcome, steps

LIMITS = [limit for limit in load_limits("0.2.0") if limit.healthy is not None]
TWO_READINGS = Failures({("staircase", "spring", "ring"): 2.0, ("staircase", "excursion_hand", "ring"): -3.0})
EXCHANGE = Proposal(steps()["exchange"], Channel.INDEX, Channel.MIDDLE)


def value_of(limit, excess):
    """Return the reading with an excess above the healthy ones, or below them where only the lower side is limited."""
    low, high = limit.healthy
    return (
        high + excess * (limit.at_most - high)
        if limit.at_most < float("inf")
        else low - excess * (low - limit.at_least)
    )


def run_of(limit, excess):
    subject = limit.subjects[0]
    return Failures.of({limit.experiment: {subject: {limit.metric: value_of(limit, excess)}}}, [limit])


@given(st.sampled_from(LIMITS), st.floats(1.01, 3.0), st.floats(0.01, 0.99))
def test_a_failed_reading_that_passes_by_chance_has_not_gone(limit, failed, passed):
    before, after = run_of(limit, failed), run_of(limit, passed)
    warms = EVIDENCE[limit.experiment, limit.metric] is EvidenceKind.OWN_SENSOR
    assert before.off
    assert not after.off
    assert outcome_of(before, after, EXCHANGE) is (StepOutcome.GONE if warms else StepOutcome.STAYS)


@given(st.sampled_from(LIMITS), st.floats(1.01, 3.0), st.floats(0.0, 1.0))
def test_a_failed_reading_among_those_of_healthy_hands_has_gone(limit, failed, share):
    low, high = limit.healthy
    subject = limit.subjects[0]
    healthy = {limit.experiment: {subject: {limit.metric: low + share * (high - low)}}}
    assert not any(excesses(healthy, [limit]).values())
    assert outcome_of(run_of(limit, failed), Failures.of(healthy, [limit]), EXCHANGE) is StepOutcome.GONE


@given(st.sampled_from([one for one in steps().values() if one.runs and not one.restores and one.name != AGAIN]))
def test_a_failure_that_a_step_in_doubt_has_ended_convicts_no_later_step(step):
    """Servos with their old IDs; homing had ended the failure, and the next step, another computer, was convicted."""
    at = Channel.RING if step.of_one_channel else None
    suspects = frozenset({Suspect(Part.SERVO, Channel.RING), Suspect(Part.DIGIT, Channel.RING), Suspect(Part.COMPUTER)})
    case = DiagnosisCase((AmbiguityGroup(TWO_READINGS, suspects),))
    doubted = case.after(Proposal(step, at, at and Channel.PINKY), StepOutcome.UNSURE)
    assert doubted.next_step.step.name == AGAIN
    gone = doubted.after(doubted.next_step, StepOutcome.GONE)
    assert (gone.state, gone.told) == (CaseState.NOT_SEEN_AGAIN, ())
    stays = doubted.after(doubted.next_step, StepOutcome.STAYS)
    assert stays.state is CaseState.GOES_ON
    assert stays.next_step.step.name != AGAIN
