"""One run: the same trial gives the same numbers, and a fault changes them."""

from dataclasses import asdict, replace
from functools import cache

from hypothesis import given
from hypothesis import strategies as st

from model.units.conditions import CONDITIONS
from train.campaign.trial import Trial, faulty_hands, healthy_hands, perform

TRIAL = Trial("plausible:5", seed=5, experiments=("presence", "audit"))


@cache
def healthy():
    return perform(TRIAL)


def test_a_trial_depends_on_nothing_else():
    assert perform(TRIAL).numbers == healthy().numbers


def test_a_fault_is_in_the_numbers_and_a_healthy_hand_is_not_accused():
    faulty = perform(replace(TRIAL, faults=("motor_dead:ring",)))
    assert "audit/followed/ring" in faulty.failed
    assert (healthy().failed, healthy().stopped) == ((), "")


def test_a_fault_that_never_fires_is_no_success():
    outcome = perform(replace(TRIAL, faults=("encoder_slip:index=40@500",)))
    assert outcome.ended == "FaultNeverFiredError"
    assert outcome.stopped


def test_a_hand_that_falls_silent_is_an_outcome():
    outcome = perform(replace(TRIAL, faults=("board_hangs@1",)))
    assert outcome.stopped
    assert outcome.ended


def test_a_hand_that_cannot_even_be_homed_is_an_outcome():
    """A guarded board that is older than declared refuses what the guard sets first."""
    outcome = perform(replace(TRIAL, firmware="0.1.0", guarded=True, faults=("board_runs_pre",)))
    assert outcome.ended == "SafetyStopError"
    assert "SET_SPE" in outcome.stopped


def test_conditions_are_part_of_a_trial_and_accuse_nobody():
    found = replace(TRIAL, conditions=("gravity", "lateness", "settings"))
    assert found.key != TRIAL.key
    assert Trial.of(asdict(found)) == found
    outcome = perform(found)
    assert outcome.numbers != healthy().numbers
    assert (outcome.failed, outcome.stopped) == ((), "")


@given(st.integers(0, 1000), st.integers(2, 10))
def test_half_of_the_healthy_hands_are_found_under_conditions_and_no_faulty_one(first, eights):
    hands = healthy_hands(first, 8 * eights)
    assert abs(sum(bool(hand.conditions) for hand in hands) - 4 * eights) <= 4
    assert all(hand.conditions in {(), CONDITIONS} for hand in hands)
    assert {hand.conditions for hand in healthy_hands(first, 8, conditions=("gravity",))} == {("gravity",)}
    assert {hand.conditions for hand in faulty_hands(["motor_dead"], first, 16)} == {()}
