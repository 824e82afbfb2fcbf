"""Faulty hands that are drawn: the same ones every time, every cause in turn, and each a fault that can be."""

from hypothesis import given
from hypothesis import strategies as st

from hil.faults import CATALOGUE, parse_fault
from hil.faults.fault import HOMED
from hil.lab.campaign.drawn import LATEST_S, drawable, drawn_hands
from hil.lab.campaign.learning import cause_of


def faults(trials):
    return [parse_fault(trial.faults[0]) for trial in trials]


@given(st.integers(0, 100_000), st.integers(1, 80))
def test_a_campaign_that_is_made_longer_goes_on_as_it_began(first, count):
    assert drawn_hands(first, count) == drawn_hands(first, count + 7)[:count]


def test_every_cause_comes_once_before_any_comes_again():
    causes = {kind.cause for kind in drawable()}
    firsts = [cause_of(fault) for fault in faults(drawn_hands(5, len(causes)))]
    # A board that runs what was declared has no fault, and another version takes its place.
    assert set(firsts) == causes


@given(st.integers(0, 100_000))
def test_what_is_drawn_lies_between_mild_and_severe_and_begins_while_the_hand_is_validated(first):
    for trial in drawn_hands(first, 60):
        fault = parse_fault(trial.faults[0])
        kind = CATALOGUE[fault.name]
        low, high = sorted((kind.severities[0], kind.severities[2]))
        assert low * 0.99 <= fault.severity <= high * 1.01
        assert fault.at_s <= LATEST_S
        assert kind.visible
        assert kind.reason != HOMED
        assert fault.name != f"board_runs_{trial.firmware}"
