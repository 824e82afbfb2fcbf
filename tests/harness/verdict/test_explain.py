"""The dictionary explains a run by the fault whose readings are most like it, wherever it sits."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import FINGERS, Channel
from hil.faults import parse_fault
from hil.verdict.dictionary import Entry, dictionary_text
from hil.verdict.explain import distance, explain, telling
from hil.verdict.signature import compressed, signature

SLACK = Entry(
    "slack", parse_fault("cable_snapped:index=1"), {"own/staircase/take_up": 2.5, "own/staircase/spring": -1.5}
)
WEAK = Entry("weak", parse_fault("motor_weak:index=0.8"), {"own/excursion/closed_percent": -2.0})
DEAF = Entry("deaf", parse_fault("reply_lost=0.3"), {"ended/LinkTimeoutError": 1.4})
DICTIONARY = (SLACK, WEAK, DEAF)

NAMES = st.sampled_from(["own/a", "own/b", "hand/c", "others/d"])
SIGNATURES = st.dictionaries(NAMES, st.floats(0.1, 3) | st.floats(-3, -0.1))


def reading(channel, experiment, metric, excess):
    return {(experiment, metric, channel.label): excess}


@given(st.sampled_from(FINGERS))
def test_a_fault_that_was_learned_on_one_finger_is_known_on_all(finger):
    found = reading(finger, "staircase", "take_up", 11.0) | reading(finger, "staircase", "spring", -3.5)
    first = explain(found, "", (), DICTIONARY)[0]
    assert (first.cause, first.channel) == ("slack", finger)


def test_a_fault_is_looked_for_wherever_it_may_sit():
    found = reading(Channel.THUMB_FLEXOR, "staircase", "take_up", 11.0)
    assert explain(found, "", (), DICTIONARY)[0].channel is Channel.THUMB_FLEXOR
    # The abduction is no cable.
    found = reading(Channel.THUMB_ABDUCTION, "staircase", "take_up", 11.0)
    assert explain(found, "", (), (SLACK,))[0].channel is not Channel.THUMB_ABDUCTION


@given(st.floats(-20, 20), st.sampled_from(list(Channel)))
def test_probabilities_add_up_to_one(excess, channel):
    ranked = explain(reading(channel, "staircase", "take_up", excess), "", ("replay",), DICTIONARY)
    assert sum(e.probability for e in ranked) == pytest.approx(1.0)
    assert [e.probability for e in ranked] == sorted((e.probability for e in ranked), reverse=True)


def test_how_a_run_ended_is_evidence():
    assert explain({}, "LinkTimeoutError", (), DICTIONARY)[0].cause == "deaf"


def test_many_entries_of_one_cause_are_no_argument_for_it():
    found = reading(Channel.INDEX, "excursion", "closed_percent", -6.4)
    crowded = explain(found, "", (), (SLACK, WEAK, DEAF, *[SLACK] * 50))
    assert crowded[0].probability == pytest.approx(explain(found, "", (), DICTIONARY)[0].probability)


@given(SIGNATURES, SIGNATURES)
def test_distance_is_symmetric_and_zero_for_the_same(one, other):
    assert distance(one, other) == pytest.approx(distance(other, one), abs=1e-12)
    assert distance(one, one) == pytest.approx(0.0, abs=1e-12)


@given(SIGNATURES, SIGNATURES, SIGNATURES)
def test_no_way_round_is_shorter(one, other, third):
    assert distance(one, third) <= distance(one, other) + distance(other, third) + 1e-9


def test_a_fault_is_not_held_to_what_was_not_asked():
    both = {**SLACK.features, "own/replay/replay_shape": 6.0}
    entry = Entry("slack", parse_fault("cable_snapped:index=1"), both)
    found = reading(Channel.INDEX, "staircase", "take_up", 17.0)
    assert explain(found, "", (), (entry, WEAK))[0].cause == "slack"
    assert explain(found, "", ("replay", "excursion"), (entry, WEAK))[0].cause == "weak"


@given(st.floats(-1000, 1000))
def test_compression_keeps_the_sign_and_the_order(place):
    assert compressed(place) * place >= 0.0
    assert abs(compressed(place)) <= abs(compressed(2 * place))


@given(st.floats(-0.5, 0.5))
def test_what_any_hand_reads_is_no_feature(place):
    assert compressed(place) == 0.0


def test_a_signature_sees_the_own_channel_and_the_worst_of_the_others():
    found = {
        ("audit", "followed", "index"): -4.0,
        ("audit", "followed", "ring"): 2.0,
        ("audit", "followed", "pinky"): -9.0,
        ("presence", "round_trip", "hand"): 3.0,
    }
    seen = signature(found, "LinkTimeoutError", Channel.INDEX)
    assert seen["own/audit/followed"] == compressed(-4.0)
    assert seen["others/audit/followed"] == compressed(-9.0)
    assert seen["hand/presence/round_trip"] == compressed(3.0)
    assert "ended/LinkTimeoutError" in seen


def test_what_tells_two_causes_apart_is_what_was_not_yet_seen():
    assert telling(SLACK.features, WEAK.features, {"own/staircase/take_up": 2.4}) == "own/excursion/closed_percent"
    assert telling(SLACK.features, SLACK.features, SLACK.features) is None


def test_what_two_causes_have_in_common_does_not_tell_them_apart():
    assert telling({"own/a": 2.0, "own/b": 0.5}, {"own/a": 2.0}, {}) == "own/b"


def test_of_features_that_tell_as_much_the_first_by_name_is_meant():
    """Whatever order a set of names has in this run of Python."""
    names = [f"own/{name}" for name in "hdgaefcb"]
    assert telling(dict.fromkeys(names, 1.0), {}, {}) == "own/a"


def test_a_dictionary_is_read_as_it_was_written():
    import json  # noqa: PLC0415

    table = json.loads(dictionary_text(DICTIONARY, {"trials": 3}))
    assert [row["cause"] for row in table["entries"]] == ["slack", "weak", "deaf"]


def test_probabilities_follow_from_the_distance_between_signatures():
    """Of the run's 7.2941, "one" lacks 1, the last 2 and the other all and 1 more; a likeness falls to 1/e over 0.5."""
    whole = 7.294050
    entries = (
        Entry("one", parse_fault("reply_lost=0.1"), {"hand/a/b": whole - 1.0}),
        Entry("two", parse_fault("reply_lost=0.2"), {"hand/a/f": 1.0}),
        Entry("two", parse_fault("reply_lost=0.3"), {"hand/a/b": whole - 2.0}),
    )
    one, two = explain({("a", "b", "hand"): 1000.0}, "", (), entries)
    assert (one.cause, one.channel, str(one.fault)) == ("one", None, "reply_lost=0.1")
    assert (two.cause, two.channel, str(two.fault)) == ("two", None, "reply_lost=0.3")
    likeness = math.exp(-2.0) / 2
    assert one.probability == pytest.approx(1 / (1 + likeness), abs=1e-5)
    assert two.probability == pytest.approx(likeness / (1 + likeness), abs=1e-5)


def test_a_run_without_a_sign_is_nearest_to_what_shows_least():
    assert [e.cause for e in explain({}, "", ("excursion",), (SLACK, WEAK))] == ["slack", "weak"]
    assert explain({}, "", (), ()) == ()


def test_distances_are_sums_of_differences():
    assert distance({"a": 3.0, "b": 4.0}, {"a": 3.0}) == 4.0
    assert distance({"a": 3.0, "b": 4.0}, {"b": -2.0}) == 9.0
    assert distance({}, {}) == 0.0
