"""Each of ten mistakes a builder can make is found by the check that should, in words that name the cause."""

import dataclasses

import pytest
from drawn import drawn

from hil.checks import EXPERIMENTS
from hil.checks.staircase.check import Staircase, run_staircase
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.verdict.findings import failed
from hil.verdict.validation import validate
from simulator import RoutedHand

WRONG_WINDOW = "board_runs_0.2.0"
FOUND_BY = {
    "thumb_cables_swapped": ("excursion", "closed_percent", "thumb_flexor"),
    "winding_reversed:ring": ("staircase", "spring", "ring"),
    "cable_long:middle=20": ("staircase", "take_up", "middle"),
    "stiff_joint:index=0.25": ("staircase", "friction", "index"),
    "trim_left_in:middle=56": ("audit", "quantum_fits", "middle"),
    "servo_missing:middle": ("presence", "distinct_readings", "hand"),
    WRONG_WINDOW: ("coupling", "stop_without_abduction", "thumb_cmc_flexion"),
    "winding_reversed:thumb_abduction": ("audit", "followed", "thumb_abduction"),
    "servo_hot:ring=67": ("presence", "temperature", "ring"),
    "reply_lost=0.11": ("presence", "lost_replies", "hand"),
}
"""Fault; experiment, check and subject."""


@pytest.fixture(autouse=True)
def short_staircase(monkeypatch):
    """Six levels are enough for the loads."""

    def run(target, recorder, progress):
        run_staircase(target, recorder, RoutedHand(target.side), Staircase(levels=6, hold_s=0.44), progress=progress)

    monkeypatch.setitem(EXPERIMENTS, "staircase", dataclasses.replace(EXPERIMENTS["staircase"], run=run))


def opened(*faults):
    firmware = "0.1.5" if WRONG_WINDOW in faults else "0.2.0"
    return open_target(unit="reference", firmware=firmware, seed=1, faults=map(parse_fault, faults))


@pytest.mark.parametrize("mistake", drawn(FOUND_BY, 5))
def test_the_mistake_is_reported_by_its_check(mistake):
    experiment, check, subject = FOUND_BY[mistake]
    with opened(mistake) as target:
        result = validate(target, [experiment])
    found = [finding for finding in failed(result.findings) if (finding.check, finding.subject) == (check, subject)]
    assert found, [finding.sentence for finding in result.findings]


@pytest.mark.parametrize("experiment", sorted({entry[0] for entry in FOUND_BY.values()}))
def test_a_good_hand_passes_the_same_checks(experiment):
    relevant = {(check, subject) for name, check, subject in FOUND_BY.values() if name == experiment}
    with opened() as target:
        result = validate(target, [experiment])
    assert not {(f.check, f.subject) for f in failed(result.findings)} & relevant


def test_a_hand_that_fails_presence_is_not_moved():
    with opened("servo_hot:ring=67") as target:
        result = validate(target, ["presence", "audit"])
        sent = [record.data[0] for record in target.wire.since(0, 0.0) if record.direction == "to_hand"]
    assert list(result.results) == ["presence"]
    assert result.end.finding.check == "motion through the range"
    assert 0x11 not in sent
