"""How a run ended, and what its finding says."""

import pytest

from aero.errors import LinkTimeoutError
from aero.safety import SafetyStopError
from hil.emulated.any_hand import open_target
from hil.recordings.mcap_file import read_recording
from hil.targets.hand_errors import FaultNeverFiredError
from hil.verdict.run_end import FINISHED, EndKind, RunEnd, aborted, ended_at_closing
from hil.verdict.validation import validate


def test_a_run_that_finished_has_nothing_to_say():
    assert FINISHED.finding is None
    assert FINISHED.error_name == ""


@pytest.mark.parametrize(
    ("end", "check", "measured", "source", "meaning"),
    [
        (
            RunEnd(EndKind.GATE, "presence"),
            "motion through the range",
            "not run",
            "fails presence",
            "presence failed",
        ),
        (
            RunEnd(EndKind.NOT_PERMITTED, "coupling, replay", "Too hot."),
            "coupling, replay",
            "not run",
            "the guard",
            "Too hot.",
        ),
        (RunEnd(EndKind.INCOMPLETE, "audit"), "audit", "aborted", "the recording", "is truncated"),
        (RunEnd(EndKind.FAULT_NEVER_FIRED, reason="It never came."), "fault", "absent", "--fault", "It never came."),
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
        (KeyboardInterrupt(), EndKind.INTERRUPTED, "KeyboardInterrupt"),
        (SystemExit(143), EndKind.INTERRUPTED, "SystemExit"),
        (LinkTimeoutError("no reply"), EndKind.LINK, "LinkTimeoutError"),
        (OSError("gone"), EndKind.LINK, "OSError"),
    ],
)
def test_what_broke_off_is_a_person_or_the_driver(error, way, name):
    end = aborted("audit", error, ())
    assert (end.kind, end.at, end.error, end.error_name) == (way, "audit", error, name)
    assert (str(error) in end.finding.meaning) or way is EndKind.INTERRUPTED


@pytest.mark.parametrize(
    ("error", "way"),
    [
        (FaultNeverFiredError("motor_dead:ring never had an effect."), EndKind.FAULT_NEVER_FIRED),
        (SafetyStopError("SWITCH THE HAND'S SUPPLY OFF: it may still be closed"), EndKind.NOT_OPENED),
    ],
)
def test_a_whole_run_whose_hand_ended_with_an_error_has_a_finding(error, way):
    end = ended_at_closing(FINISHED, error)
    assert (end.kind, end.error, end.finding.passed) == (way, error, False)
    assert str(error)[1:].rstrip(".") in end.finding.meaning


def test_a_run_that_was_aborted_before_keeps_its_reason():
    before = aborted("audit", LinkTimeoutError("no reply"), ())
    end = ended_at_closing(before, error := SafetyStopError("it may still be closed"))
    assert (end.kind, end.at, end.reason, end.error) == (EndKind.LINK, "audit", "no reply", error)


@pytest.mark.parametrize("error", [KeyboardInterrupt, LinkTimeoutError])
def test_the_recording_of_an_experiment_that_was_cut_is_unfinished(error, monkeypatch, tmp_path):
    """Half an experiment is never judged as a whole one."""
    with open_target() as target:
        real, left = target.hand.read_codes, iter(range(60))

        def cut():
            if next(left, None) is None:
                raise error("cut")
            return real()

        monkeypatch.setattr(target.hand, "read_codes", cut)
        done = validate(target, ("presence", "audit"), folder=tmp_path)
    (recording,) = done.end.cut
    assert not recording.header.finished
    assert not read_recording(tmp_path / "audit.mcap").header.finished
    assert read_recording(tmp_path / "presence.mcap").header.finished
