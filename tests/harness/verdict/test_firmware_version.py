"""A healthy hand that runs another firmware than was named, judged by readings of healthy hands."""

import json
from dataclasses import dataclass
from pathlib import Path

import pytest

from aero.firmware import firmware_of
from hil.verdict.firmware_version import limits_of_others, other_versions
from hil.verdict.limits import excesses, load_limits


@dataclass(frozen=True)
class Read:
    """A hand of the population, with what it read: `train.limits.population` draws it."""

    unit: str
    firmware: str
    guarded: bool
    numbers: dict[str, dict[str, dict[str, float]]]


KEPT = [
    Read(**table) for table in json.loads(Path(__file__).with_name("healthy_hands.json").read_text(encoding="utf-8"))
]
NAMED = ("pre", "0.1.0", "0.1.5", "0.2.0")


def told(hand, named, numbers=None):
    """Return what is said of a kept hand when a version is named, whatever it ran."""
    numbers = numbers or hand.numbers
    guarded = hand.guarded
    off = excesses(numbers, load_limits(named, guarded=guarded))
    return other_versions(numbers, off, named, limits_of_others(named, guarded=guarded))


def differ(one, other):
    """Whether what a hand reads tells two versions apart: the period of `pre`, the windows of 0.2.0."""
    one, other = firmware_of(one), firmware_of(other)
    return (one.settings is None) != (other.settings is None) or one.calibration_states != other.calibration_states


@pytest.mark.parametrize("named", NAMED)
@pytest.mark.parametrize("hand", KEPT, ids=lambda hand: f"{hand.unit}-{hand.firmware}")
def test_a_healthy_hand_with_another_firmware_is_told_from_the_named_one(hand, named):
    found = told(hand, named)
    assert bool(found) == differ(hand.firmware, named)


@pytest.mark.parametrize("named", NAMED)
def test_a_finger_that_is_off_as_well_is_no_other_versions(named):
    for hand in KEPT:
        numbers = {name: {on: dict(found) for on, found in table.items()} for name, table in hand.numbers.items()}
        numbers["excursion"]["ring"]["closed_percent"] = 40.0
        assert told(hand, named, numbers) == ()


def test_one_reading_alone_is_not_enough():
    hand = next(hand for hand in KEPT if hand.firmware == "0.2.0")
    off = {("excursion", "closed_percent", "thumb_cmc_flexion"): 9.0}
    others = limits_of_others("0.1.5", guarded=hand.guarded)
    assert other_versions(hand.numbers, off, "0.1.5", others) == ()


def told_with(off):
    """Return what is said of a kept hand of 0.2.0 of which 0.1.5 was named, when these readings are off by 0.1.5."""
    hand = next(hand for hand in KEPT if hand.firmware == "0.2.0")
    others = limits_of_others("0.1.5", guarded=hand.guarded)
    return other_versions(hand.numbers, off, "0.1.5", others)


STOPS = {
    ("excursion", "closed_percent", "thumb_cmc_flexion"): 9.0,
    ("coupling", "stop_without_abduction", "thumb_cmc_flexion"): 9.0,
}


def test_readings_that_versions_share_are_not_enough():
    assert told_with(STOPS)
    # A derailed cable at the first experiments, of which no reading differs between versions.
    derailed = {("audit", "followed", "thumb_cmc_flexion"): -1.7, ("audit", "pull", "thumb_cmc_flexion"): 1.4}
    assert told_with(derailed) == ()
    assert told_with({**derailed, **STOPS})


def test_what_the_map_of_the_named_version_reads_does_not_count():
    hand = next(hand for hand in KEPT if hand.firmware == "0.2.0")
    numbers = {name: {on: dict(found) for on, found in table.items()} for name, table in hand.numbers.items()}
    # No healthy hand of 0.2.0 travels so far through its own map.
    numbers["staircase"]["thumb_cmc_flexion"]["excursion_hand"] = 61.0
    assert told(hand, "0.1.5", numbers)
