"""The causes of a run in words, by a dictionary made by hand."""

import pytest

from aero.channels import Channel
from hil.faults import CATALOGUE, parse_fault
from hil.verdict import diagnose as module
from hil.verdict.diagnose import diagnose
from hil.verdict.dictionary import Entry
from hil.verdict.limits import Limit

LIMITS = tuple(
    Limit(experiment, metric, subjects, "test", at_most=2.0, healthy=(0.0, 1.0))
    for experiment, metric, subjects in (
        ("staircase", "friction", ("index", "ring")),
        ("staircase", "take_up", ("index", "ring")),
        ("presence", "round_trip", ("hand",)),
    )
)
ENTRIES = (
    Entry("stiff", parse_fault("gear_friction:index=0.2"), {"own/staircase/friction": 2.0}),
    Entry("slack", parse_fault("cable_long:index=4"), {"own/staircase/friction": 1.0, "own/staircase/take_up": 2.5}),
    Entry("late", parse_fault("reply_delayed=20"), {"hand/presence/round_trip": 2.0}),
    Entry("gone", parse_fault("link_silent=1"), {"ended/LinkTimeoutError": 7.3}),
    Entry("others", parse_fault("supply_low=0.4"), {"others/staircase/take_up": 2.0}),
    Entry("weak", parse_fault("motor_weak:index=0.8"), {"own/staircase/friction": -2.0}),
)


@pytest.fixture(autouse=True)
def dictionary(monkeypatch):
    monkeypatch.setattr(module, "_dictionary", lambda: ENTRIES)


def test_the_likeliest_cause_comes_first_with_what_tells_it_from_the_next():
    found = diagnose({"staircase": {"ring": {"friction": 9.0, "take_up": 0.5}}}, LIMITS, "", ["presence"]).causes
    assert len(found) == 5
    assert (found[0].cause, found[0].channel, str(found[0].fault)) == ("stiff", Channel.RING, "gear_friction:index=0.2")
    assert found[0].meaning == f"{CATALOGUE['gear_friction'].meaning}."
    assert found[1].cause == "slack"
    assert found[0].next_look == (
        "To tell it from slack, run `aero-hil validate --only staircase`: "
        "this cause does not change the slack of the cable of this channel."
    )
    assert found[2].cause == "late"
    assert "To tell it from messages that come late, run `aero-hil validate --only staircase`" in found[1].next_look
    assert found[1].next_look.endswith("this cause changes the slack of the cable of this channel.")
    assert found[-1].next_look == ""


def test_a_cause_of_the_whole_hand_is_told_by_how_the_run_ended():
    found = diagnose({"presence": {"hand": {"round_trip": 9.0}}}, LIMITS, "", []).causes
    assert (found[0].cause, found[0].channel) == ("late", None)
    found = diagnose({}, LIMITS, "LinkTimeoutError", ["staircase"]).causes
    assert (found[0].cause, str(found[0].fault)) == ("gone", "link_silent=1.0@5.0")


@pytest.mark.parametrize(
    ("feature", "words"),
    [
        (
            "hand/presence/round_trip",
            "run `aero-hil validate --only presence`: this cause changes the round trip of the hand.",
        ),
        (
            "others/staircase/spring",
            "run `aero-hil validate --only staircase`: this cause changes the spring load of the other channels.",
        ),
        (
            "hand/session/restarts",
            "run `aero-hil validate`: this cause changes the number of restarts of the board of the hand.",
        ),
        ("ended/OSError", "validate again and see whether the run comes to its end."),
    ],
)
def test_where_to_look_next_is_named(feature, words):
    assert module._next_look({feature: -2.0}, {}, {}, "slack") == f"To tell it from slack, {words}"
    assert module._next_look({feature: 2.0}, {}, {feature: 1.0}, "slack").startswith("No further reading tells")


def test_the_smaller_of_two_effects_does_not_move_it():
    words = module._next_look({"own/a/b": 1.0}, {"own/a/b": -2.0}, {}, "slack")
    assert words.endswith("this cause does not change the b of this channel.")
    assert module._next_look({"own/a/b": 2.0}, {"own/a/b": 2.0}, {}, "slack").endswith(
        "does not change the b of this channel."
    )
