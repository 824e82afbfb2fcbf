"""The causes of a run in words, by a dictionary made by hand."""

import pytest

from aero.channels import Channel
from hil.checks import DRIVER
from hil.faults import CATALOGUE, parse_fault
from hil.verdict import diagnose as module
from hil.verdict.diagnose import diagnose, telling
from hil.verdict.dictionary import Entry
from hil.verdict.ending import EndSignature
from hil.verdict.explanation import Effect, Place
from hil.verdict.limits import Limit
from hil.verdict.locate import DRIVER_OR_MAP
from tests.support.references import reference_of

LIMITS = tuple(
    Limit(experiment, metric, subjects, "test", at_most=2.0, healthy=(0.0, 1.0))
    for experiment, metric, subjects in (
        ("staircase", "friction", ("index", "ring")),
        ("staircase", "take_up", ("index", "ring")),
        ("presence", "round_trip", ("hand",)),
        (DRIVER.name, "order", ("ring",)),
    )
)
ENTRIES = tuple(
    Entry(CATALOGUE[parse_fault(fault).name].cause, parse_fault(fault), features)
    for fault, features in (
        ("gear_friction:index=0.2", {"own/staircase/friction": 4.0}),
        ("cable_long:index=4", {"own/staircase/friction": 2.0, "own/staircase/take_up": 3.5}),
        ("reply_delayed=20", {"hand/presence/round_trip": 2.0}),
        ("link_silent=1", {"hand/ended/LinkTimeoutError": 7.3}),
        ("supply_low=0.4", {"others/staircase/take_up": 2.0}),
        ("motor_weak:index=0.8", {"own/staircase/friction": -2.0}),
    )
)


@pytest.fixture(autouse=True)
def dictionary(monkeypatch):
    monkeypatch.setattr(module, "load_reference", lambda: reference_of(ENTRIES))


def test_the_likeliest_cause_comes_first_with_what_tells_it_from_the_next():
    numbers = {"index": {"friction": 0.5, "take_up": 0.5}, "ring": {"friction": 9.0, "take_up": 0.5}}
    told = diagnose({"staircase": numbers}, LIMITS, EndSignature())
    found = told.causes
    assert len(found) == 5
    assert (found[0].cause, found[0].channel) == ("gear_friction", Channel.RING)
    assert str(found[0].fault) == "gear_friction:index=0.2"
    assert found[0].meaning == f"{CATALOGUE['gear_friction'].meaning}."
    assert found[1].cause == "cable_long"
    assert found[0].next_look == (
        "To tell it from slack cable, run `aero-hil validate --only staircase`: "
        "this cause does not change the slack of the cable of this channel."
    )
    assert found[-1].next_look == ""
    assert (told.where[0].place, told.where[0].channel) == (Place.ONE_CHANNEL, Channel.RING)
    assert told.effects[0].effect is Effect.TOO_MUCH_FRICTION
    assert told.off == (("ring", 8.0),)


def test_a_cause_of_the_whole_hand_is_told_by_how_the_run_ended():
    found = diagnose({"presence": {"hand": {"round_trip": 9.0}}}, LIMITS, EndSignature()).causes
    assert (found[0].cause, found[0].channel) == ("late", None)
    found = diagnose({}, LIMITS, EndSignature("LinkTimeoutError")).causes
    assert (found[0].cause, str(found[0].fault)) == ("link_silent", "link_silent=1.0@5.0")


def test_a_failed_check_of_the_driver_is_the_cause_whatever_the_hand_reads():
    numbers = {DRIVER.name: {"ring": {"order": 5.0}}, "staircase": {"ring": {"friction": 9.0}}}
    told = diagnose(numbers, LIMITS, EndSignature())
    assert told.where[0].place is Place.HOST_AND_DRIVER
    assert [cause.cause for cause in told.causes] == [DRIVER_OR_MAP]
    assert told.off == (("ring", 8.0),)


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
        ("hand/ended/OSError", "validate again and see whether the run ends in the same way."),
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


def test_what_two_causes_have_in_common_does_not_tell_them_apart():
    assert telling({"own/a": 2.0, "own/b": 0.5}, {"own/a": 2.0}, {}) == "own/b"
    assert telling({"own/a": 2.0}, {"own/a": 2.0}, {"own/a": 2.0}) is None


def test_of_features_that_tell_as_much_the_first_by_name_is_meant():
    """Whatever order a set of names has in this run of Python."""
    names = [f"own/{name}" for name in "hdgaefcb"]
    assert telling(dict.fromkeys(names, 1.0), {}, {}) == "own/a"
