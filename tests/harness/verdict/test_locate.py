"""Which channels are off, and which check alone decides the place."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from hil.faults import CATALOGUE
from hil.verdict.causes import CAUSES
from hil.verdict.ending import EndSignature
from hil.verdict.explanation import Place
from hil.verdict.locate import (
    MISTAKEN,
    OTHER_WINDOWS,
    channels_off,
    driver_mistaken,
    older_firmware,
    windows_moved,
)


def test_every_cause_of_the_catalogue_has_a_place_and_an_effect():
    assert {kind.cause for kind in CATALOGUE.values()} == CAUSES.keys()


def test_a_cause_of_one_channel_is_of_kinds_that_sit_on_one():
    for kind in CATALOGUE.values():
        place, _ = CAUSES[kind.cause]
        assert place is not Place.ONE_CHANNEL or kind.subjects
        assert not kind.subjects or place in (Place.ONE_CHANNEL, Place.SEVERAL_CHANNELS)


def test_the_channels_that_are_off_are_told_with_the_furthest_first():
    beyond = {
        ("audit", "pull", "ring"): -3.0,
        ("audit", "followed", "ring"): 2.0,
        ("audit", "pull", "index"): 1.0,
        ("presence", "round_trip", "hand"): 4.5,
    }
    assert channels_off(beyond) == (("hand", 4.5), ("ring", 3.0))


def test_a_failed_check_of_the_driver_decides():
    assert not driver_mistaken({("audit", "pull", "ring"): 9.0})
    assert not driver_mistaken({("driver", "sent", "ring"): 1.0})
    assert driver_mistaken({("driver", "sent", "ring"): 3.0})
    assert MISTAKEN.where[0].place is Place.HOST_AND_DRIVER
    assert MISTAKEN.where[0].probability == 1.0


def test_a_board_that_knows_no_limits_runs_older_firmware_unless_the_link_loses_more():
    silent = {("session", "unanswered_limits", "hand"): 3.0, ("session", "lost_replies", "hand"): 0.0}
    assert older_firmware(silent, EndSignature())
    assert not older_firmware({**silent, ("session", "lost_replies", "hand"): 3.0}, EndSignature())
    assert not older_firmware({("session", "lost_replies", "hand"): 3.0}, EndSignature())
    assert not older_firmware({}, EndSignature())


def test_a_hand_that_the_guard_stopped_at_the_first_limit_runs_older_firmware():
    unknown = "the board does not answer as it should (no reply to SET_SPE within 1 s)"
    assert older_firmware({}, EndSignature("SafetyStopError", unknown))
    assert not older_firmware({}, EndSignature("LinkTimeoutError", unknown))
    assert not older_firmware({}, EndSignature("SafetyStopError", "no reply to GET_POS within 1 s"))
    assert not older_firmware({("presence", "idle_current", "ring"): 0.2}, EndSignature("SafetyStopError", unknown))


def told_of_windows(**counts):
    """Judge windows that moved by so many counts in the closing direction; the limit is 10 (`checks.toml`)."""
    beyond = {("window", "window_moved", channel): moved / 10.0 for channel, moved in counts.items()}
    return windows_moved({"window": {channel: {"window_moved": moved} for channel, moved in counts.items()}}, beyond)


@pytest.mark.parametrize("sign", [-1, 1])
def test_windows_that_moved_as_0_2_0_moves_them_are_another_firmwares(sign):
    # 10 degrees are 113 counts (aero-hand-open 6a3022d): abduction further closed, CMC flexion further open.
    assert told_of_windows(thumb_abduction=sign * 113.0, thumb_cmc_flexion=-sign * 113.0, ring=0.0) == OTHER_WINDOWS


@pytest.mark.parametrize(
    "moved",
    [
        {"thumb_abduction": 113.0, "thumb_cmc_flexion": 113.0},
        {"thumb_abduction": 113.0, "thumb_cmc_flexion": -102.0},
        {"thumb_abduction": 113.0, "thumb_cmc_flexion": -113.0, "ring": 40.0},
        {"index": 113.0, "ring": -113.0},
        {},
    ],
)
def test_windows_that_moved_otherwise_say_nothing_for_certain(moved):
    assert told_of_windows(**moved) is None


@given(st.sampled_from(list(Channel)), st.integers(11, 2048), st.sampled_from([-1, 1]))
def test_one_moved_window_is_a_trim_of_its_channel(channel, counts, sign):
    told = told_of_windows(**{one.label: sign * counts * (one is channel) for one in Channel})
    assert (told.where[0].place, told.where[0].channel) == (Place.ONE_CHANNEL, channel)
    assert told.shown == ("trim_left_in",)


def test_no_window_is_asked_about_in_the_usual_run():
    assert windows_moved({}, {}) is None
