"""Each of ten mistakes a builder can make is found by the check that should, in words that name the cause."""

import dataclasses

import pytest
from build_errors import BUILD_ERRORS, BuildError, spoiled

from hil.checks import EXPERIMENTS
from hil.checks.staircase.check import Staircase, run_staircase
from hil.verdict.findings import failed
from hil.verdict.validation import validate
from model import RoutedHand

FOUND_BY = {
    "two cables swapped": ("excursion", "closed_percent", "thumb_flexor", "two cables are swapped"),
    "cable wound backwards": ("staircase", "spring", "ring", "wound backwards"),
    "cable slack by 20 mm": ("staircase", "take_up", "middle", "The cable is slack"),
    "stiff joint": ("staircase", "friction", "index", "stiff joint"),
    "trimmed servo": ("audit", "quantum_fits", "middle", "trimmed"),
    "servo of the wrong ID": ("presence", "distinct_readings", "hand", "wrong ID"),
    "wrong firmware window": ("excursion", "closed_angle", "thumb_cmc_flexion", "wrong firmware window"),
    "reversed abduction": ("audit", "followed", "thumb_abduction", "reversed"),
    "hot servo": ("presence", "temperature", "ring", "hot servo"),
    "lossy cable": ("presence", "lost_replies", "hand", "lossy cable"),
}
"""Experiment, check, subject, and words of the meaning."""


@pytest.fixture(autouse=True)
def short_staircase(monkeypatch):
    """Six levels are enough for the loads."""

    def run(target, recorder, progress):
        run_staircase(target, recorder, RoutedHand(target.side), Staircase(levels=6, hold_s=0.44), progress=progress)

    monkeypatch.setitem(EXPERIMENTS, "staircase", dataclasses.replace(EXPERIMENTS["staircase"], run=run))


def test_all_mistakes_have_a_check():
    assert FOUND_BY.keys() == BUILD_ERRORS.keys()


@pytest.mark.parametrize("mistake", FOUND_BY)
def test_the_mistake_is_reported_by_its_check(mistake):
    experiment, check, subject, words = FOUND_BY[mistake]
    with spoiled(BUILD_ERRORS[mistake]) as target:
        result = validate(target, [experiment])
    found = [finding for finding in failed(result.findings) if (finding.check, finding.subject) == (check, subject)]
    assert found, [finding.sentence for finding in result.findings]
    assert words.lower() in found[0].meaning.lower()


@pytest.mark.parametrize("experiment", sorted({entry[0] for entry in FOUND_BY.values()}))
def test_a_good_hand_passes_the_same_checks(experiment):
    relevant = {(check, subject) for name, check, subject, _ in FOUND_BY.values() if name == experiment}
    with spoiled(BuildError()) as target:
        result = validate(target, [experiment])
    assert not {(f.check, f.subject) for f in failed(result.findings)} & relevant


def test_a_hand_that_fails_presence_is_not_moved():
    with spoiled(BUILD_ERRORS["hot servo"]) as target:
        result = validate(target, ["presence", "audit"])
    assert list(result.results) == ["presence"]
    assert result.end.finding.check == "after presence"
    assert not any(record.data[0] == 0x11 for record in target.wire.since(0, 0.0) if record.direction == "to_hand")
