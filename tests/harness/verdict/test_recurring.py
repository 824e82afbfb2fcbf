"""Readings near their limit: a hand that fails in one run and passes in the next still has its fault."""

from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from hil.checks.shared.declaration import EvidenceKind
from hil.verdict.failures import EVIDENCE, Failures
from hil.verdict.group import Proposal
from hil.verdict.limits import excesses, load_limits
from hil.verdict.outcome import outcome_of
from hil.verdict.steps import StepOutcome, steps

LIMITS = [limit for limit in load_limits("0.2.0") if limit.healthy is not None]
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
