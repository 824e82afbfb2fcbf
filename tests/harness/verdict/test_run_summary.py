"""What is told first: where, the likeliest cause, one thing to do, and which findings it accounts for."""

from dataclasses import replace

import pytest
from synthetic import held

from aero.channels import Channel
from hil.faults import parse_fault
from hil.verdict import explained
from hil.verdict.dictionary import Entry
from hil.verdict.explanation import HEALTHY, Diagnosis, Explanation, Place, Whereabouts
from hil.verdict.findings import Finding
from hil.verdict.judged_run import Result, Validation
from hil.verdict.run_end import FINISHED, RunEnd, Way
from hil.verdict.run_summary import summary_of

CURRENT = Finding("holding_current", "ring", False, "2.2 A", "at most 1.5 A", "test", "Friction.", "Free it.")
OTHER = replace(CURRENT, subject="index", remedy="Look at the index finger.")
GOOD = replace(CURRENT, subject="middle", passed=True)
WEAK = Explanation("motor_weak", Channel.RING, 0.8, parse_fault("motor_weak:ring=0.5"), "a motor is weak.")
FAINT = replace(WEAK, cause="gear_friction", probability=0.004)
ENTRIES = (Entry("motor_weak", parse_fault("motor_weak:index=0.4"), {"own/holding/holding_current": 3.0}),)
WHERE = (Whereabouts(Place.ONE_CHANNEL, Channel.RING, 0.9),)


@pytest.fixture(autouse=True)
def dictionary(monkeypatch):
    explained._expected.cache_clear()
    monkeypatch.setattr(explained, "load_dictionary", lambda: ENTRIES)
    yield
    explained._expected.cache_clear()


def run(*findings, diagnosis=HEALTHY, end=FINISHED, reading=9.0):
    numbers = {label: {"holding_current": reading} for label in ("index", "middle", "ring")}
    recording = held("holding", [[0] * 7], 0.1)
    recording = replace(recording, header=replace(recording.header, limits="aero_hand_open"))
    return Validation({"holding": Result(recording, numbers, findings)}, end, 1.0, diagnosis=diagnosis)


def known(*causes, shown=("motor_weak",)):
    return Diagnosis(WHERE, (), causes, shown)


def test_a_good_hand_has_nothing_to_do():
    found = summary_of(run(GOOD))
    assert (found.where, found.likeliest, found.step, found.explained, found.unexplained) == ("", None, None, (), ())


def test_the_likeliest_cause_says_what_to_do_and_accounts_for_its_own_finding_only():
    found = summary_of(run(CURRENT, OTHER, GOOD, diagnosis=known(WEAK, FAINT, shown=("motor_weak", "gear_friction"))))
    assert found.where == "ring finger"
    assert found.causes == (WEAK,), "a share of 0 % is told"
    assert "servo of the ring finger" in found.step.do
    assert (found.explained, found.unexplained) == ((CURRENT,), (OTHER,))


def test_a_cause_accounts_for_the_side_that_it_moves_a_reading_to():
    found = summary_of(run(CURRENT, diagnosis=known(WEAK), reading=-9.0))
    assert (found.explained, found.unexplained) == ((), (CURRENT,))


def test_what_is_unlike_anything_known_is_said_and_looked_at():
    found = summary_of(run(CURRENT, diagnosis=known(WEAK, shown=())))
    assert found.unlike
    assert (found.likeliest, found.causes) == (None, ())
    assert found.step.do == "Look at the ring finger. Free it."


@pytest.mark.parametrize(
    ("place", "words"),
    [
        (Place.LINK, "link between computer and board"),
        (Place.SUPPLY, "power supply"),
        (Place.SEVERAL_CHANNELS, "index finger and ring finger"),
    ],
)
def test_the_place_is_told_in_words(place, words):
    found = summary_of(run(CURRENT, OTHER, diagnosis=Diagnosis((Whereabouts(place, None, 0.9),), (), (WEAK,), ())))
    assert found.where == words


def test_what_a_person_broke_off_is_run_again():
    found = summary_of(run(GOOD, end=RunEnd(Way.PERSON, "audit")))
    assert found.where == ""
    assert found.step.do == "Run it again: it was not finished."
    assert found.step.command.startswith("aero-hil validate")


def test_a_gate_that_failed_is_accounted_for_by_what_failed_it():
    found = summary_of(run(CURRENT, diagnosis=known(WEAK), end=RunEnd(Way.GATE, "holding")))
    assert found.unexplained == ()
