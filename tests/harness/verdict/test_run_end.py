"""How a run ended, and what its finding says."""

import pytest

from aero.errors import LinkTimeoutError
from aero.safety import SafetyStopError
from hil.faults import FaultNeverFiredError
from hil.verdict.run_end import FINISHED, RunEnd, Way, broken_off, ended_at_closing


def test_a_run_that_finished_has_nothing_to_say():
    assert FINISHED.finding is None
    assert FINISHED.error_name == ""


@pytest.mark.parametrize(
    ("end", "check", "measured", "source", "meaning"),
    [
        (RunEnd(Way.GATE, "presence"), "after presence", "not run", "fails presence", "presence failed"),
        (
            RunEnd(Way.GUARD, "coupling, replay", "Too hot."),
            "coupling, replay",
            "not run",
            "the guard",
            "Too hot.",
        ),
        (RunEnd(Way.CUT, "audit"), "audit", "broken off", "the recording", "before the experiment does"),
        (RunEnd(Way.NO_FAULT, reason="It never came."), "fault", "absent", "--fault", "It never came."),
    ],
)
def test_each_way_to_end_has_its_finding(end, check, measured, source, meaning):
    finding = end.finding
    assert (finding.check, finding.subject, finding.passed, finding.measured) == (check, "hand", False, measured)
    assert source in finding.source
    assert meaning in finding.meaning
    assert finding.expected
    assert finding.remedy


@pytest.mark.parametrize(
    ("error", "way", "name"),
    [
        (KeyboardInterrupt(), Way.PERSON, "KeyboardInterrupt"),
        (SystemExit(143), Way.PERSON, "SystemExit"),
        (LinkTimeoutError("no reply"), Way.DRIVER, "LinkTimeoutError"),
        (OSError("gone"), Way.DRIVER, "OSError"),
    ],
)
def test_what_broke_off_is_a_person_or_the_driver(error, way, name):
    end = broken_off("audit", error, ())
    assert (end.way, end.at, end.error, end.error_name) == (way, "audit", error, name)
    assert (str(error) in end.finding.meaning) or way is Way.PERSON


@pytest.mark.parametrize(
    ("error", "way"),
    [
        (FaultNeverFiredError("motor_dead:ring never had an effect."), Way.NO_FAULT),
        (SafetyStopError("SWITCH THE HAND'S SUPPLY OFF: it may still be closed"), Way.NOT_OPENED),
    ],
)
def test_a_whole_run_whose_hand_ended_with_an_error_has_a_finding(error, way):
    end = ended_at_closing(FINISHED, error)
    assert (end.way, end.error, end.finding.passed) == (way, error, False)
    assert str(error)[1:].rstrip(".") in end.finding.meaning


def test_a_run_that_was_broken_off_before_keeps_its_reason():
    before = broken_off("audit", LinkTimeoutError("no reply"), ())
    end = ended_at_closing(before, error := SafetyStopError("it may still be closed"))
    assert (end.way, end.at, end.reason, end.error) == (Way.DRIVER, "audit", "no reply", error)
