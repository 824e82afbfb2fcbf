"""Which channels are off, and which check alone decides the place."""

from hil.faults import CATALOGUE
from hil.verdict.causes import CAUSES
from hil.verdict.explanation import Place
from hil.verdict.locate import MISTAKEN, channels_off, driver_mistaken, older_firmware


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
    assert older_firmware(silent)
    assert not older_firmware({**silent, ("session", "lost_replies", "hand"): 3.0})
    assert not older_firmware({("session", "lost_replies", "hand"): 3.0})
    assert not older_firmware({})
