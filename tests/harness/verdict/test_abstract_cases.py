"""Whole cases on an abstract hand: one fault, a chance event beside it, two faults, an owner who makes a mistake."""

from random import Random

from abstract_hand import AbstractFault, AbstractHand, drawn, is_of, played
from hypothesis import given, settings
from hypothesis import strategies as st

from aero.channels import FINGERS
from hil.checks.shared.declaration import EvidenceKind
from hil.verdict.part import Part

CASES = settings(max_examples=25, deadline=None)
SEEDS = st.integers(0, 2**31).map(Random)
CHANCES = [EvidenceKind.BYTES, EvidenceKind.STALL, EvidenceKind.RESTART]


def mechanical(random):
    return drawn(random, random.choice([Part.SERVO, Part.DIGIT]))


@CASES
@given(SEEDS)
def test_a_fault_is_told_and_no_good_part(random):
    fault = drawn(random)
    told = played(AbstractHand(fault)).told
    assert told
    assert all(is_of(suspect, fault) for suspect in told)


@CASES
@given(SEEDS)
def test_a_chance_event_beside_a_mechanical_fault_hides_no_part(random):
    """A restart or a lost reply in the first run made late motion evidence of the link for good."""
    fault = mechanical(random)
    chance = AbstractFault(Part.USB, None, frozenset({random.choice(CHANCES)}), chance=True)
    told = played(AbstractHand(fault, chance)).told
    assert told
    assert all(is_of(suspect, fault) for suspect in told)


def two(random):
    first, second = drawn(random), drawn(random)
    alike = first.part is second.part and first.channel is second.channel
    return two(random) if alike else (first, second)


@CASES
@given(SEEDS)
def test_two_faults_convict_no_good_part(random):
    faults = two(random)
    told = played(AbstractHand(*faults)).told
    assert all(any(is_of(suspect, fault) for fault in faults) for suspect in told)


def test_most_pairs_of_faults_are_named_both():
    """The link's clue took the late motion of a finger for good, and neither part was told: 23 of 60 pairs."""
    told = {seed: (faults := two(Random(seed)), played(AbstractHand(*faults)).told) for seed in range(1000, 1020)}
    both = [all(any(is_of(one, fault) for one in all_told) for fault in faults) for faults, all_told in told.values()]
    assert sum(both) >= 0.7 * len(both)


@CASES
@given(SEEDS)
def test_a_wrong_answer_convicts_no_good_part(random):
    fault = mechanical(random)
    assert all(is_of(suspect, fault) for suspect in played(AbstractHand(fault), wrong_answer=True).told)


@CASES
@given(SEEDS)
def test_an_exchange_that_was_not_done_convicts_no_good_part(random):
    fault = mechanical(random)
    assert all(is_of(suspect, fault) for suspect in played(AbstractHand(fault), idle=True).told)


@CASES
@given(st.sampled_from(FINGERS), st.sampled_from(FINGERS))
def test_what_an_exchange_leaves_at_a_third_digit_has_a_cause_of_its_own(servo, digit):
    """The travel of a ring was taken for a consequence of the thumb's servo, and left the case with it."""
    if servo is digit:
        return
    faults = (
        AbstractFault(Part.SERVO, servo, frozenset({EvidenceKind.TRAVEL, EvidenceKind.TORQUE, EvidenceKind.JUMP})),
        AbstractFault(Part.DIGIT, digit, frozenset({EvidenceKind.TORQUE}), shows="bend"),
    )
    told = played(AbstractHand(*faults)).told
    assert {(one.part, one.channel) for one in told} == {(Part.SERVO, servo), (Part.DIGIT, digit)}
