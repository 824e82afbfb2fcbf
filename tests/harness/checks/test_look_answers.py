"""A person's answers as numbers, on answers made by hand."""

from dataclasses import replace

import pytest

from hil.checks.look import check as look
from hil.checks.look.check import NO, NONE
from hil.recordings.recording import Recording
from tests.support.synthetic import HEADER, LABELS

GOOD = {"bent": "", **{f"moved_{label}": label for label in LABELS}, **{f"followed_{label}": "yes" for label in LABELS}}


def measured(**answers):
    return look.measure(Recording(replace(HEADER, experiment="look", parameters={**GOOD, **answers}), {}))


def test_a_good_hand_shows_nothing():
    assert set(measured()["index"].values()) == {0.0}
    assert set(measured()["thumb_flexor"].values()) == {0.0}


def test_another_finger_that_moves_is_named_by_its_place():
    """Index, middle, ring: the ring finger is the third."""
    found = measured(moved_middle="ring")
    assert found["middle"]["another_moved"] == 3.0
    assert [label for label in LABELS if found[label]["another_moved"]] == ["middle"]


def test_a_digit_that_does_not_move_at_first_starts_late():
    assert measured(moved_pinky=NONE)["pinky"] == {
        "another_moved": 0.0, "starts_late": 1.0, "stays_behind": 0.0, "bent": 0.0
    }  # fmt: skip


def test_a_digit_that_is_bent_when_open_and_a_tip_that_does_not_follow_are_told():
    found = measured(bent="index ring", followed_thumb_flexor=NO)
    assert [found[label].get("bent", 0.0) for label in LABELS[:4]] == [1.0, 0.0, 1.0, 0.0]
    assert [found[label]["stays_behind"] for label in LABELS] == [0, 0, 0, 0, 0, 0, 1]


def test_a_look_that_was_ended_has_no_numbers():
    recording = Recording(replace(HEADER, experiment="look", parameters={"bent": ""}), {})
    with pytest.raises(ValueError, match="no answer to moved_index"):
        look.measure(recording)
