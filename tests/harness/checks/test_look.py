"""A person who looks finds what no encoder can see, accuses no healthy hand, and can leave at any time."""

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from drawn import drawn
from person import Person

from aero.channels import Channel
from hil.checks.look.check import which_moved
from hil.cli import main
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.recordings.mcap_file import read_recording
from hil.verdict.findings import failed
from hil.verdict.run_end import EndKind
from hil.verdict.validation import judge_recordings, validate


def looked_at(person, *, unit, fault=None, homed=True, folder=None, guarded=None):
    faults = [parse_fault(fault)] if fault else []
    with open_target("emulated", unit=unit, faults=faults, homed=homed, guarded=guarded) as target:
        person.plant = target.truth.plant
        seen_by = replace(target, onlooker=person.answer)
        result = validate(seen_by, ["look"], folder=folder, progress=person.watch)
        return result, target.hand.read_codes()


def found(result):
    return {(finding.subject, finding.check): finding.measured for finding in failed(result.findings)}


@pytest.mark.parametrize("homed", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_no_healthy_hand_is_accused(homed):
    result, _ = looked_at(Person(), unit="plausible:90201", homed=homed)
    assert found(result) == {}
    assert result.diagnosis.step is None


@pytest.mark.parametrize(
    "fault", ["finger_ids_exchanged:middle", pytest.param("finger_cables_swapped:middle", marks=pytest.mark.slow)]
)
def test_exchanged_fingers_are_found_and_named(fault, tmp_path):
    """The answers, one of which asks for the motion again, are in the recording and are judged again."""
    result, _ = looked_at(Person(again=1), unit="plausible:90211", fault=fault, folder=tmp_path)
    assert found(result) == {
        ("middle", "another_moved"): "the ring finger",
        ("ring", "another_moved"): "the middle finger",
    }
    diagnosis = result.diagnosis
    assert diagnosis.place == "middle finger or ring finger"
    assert "cable" in diagnosis.step.do
    recording = read_recording(tmp_path / "look.mcap")
    assert recording.header.parameters["moved_middle"] == "ring"
    assert sum(event.text.startswith("Something moved") for event in recording.events) == 8
    assert found(judge_recordings([recording])) == found(result)


@pytest.mark.parametrize(
    ("fault", "check", "homed"),
    [
        pytest.param("spool_wrong:ring=1.1", "bent", True, marks=pytest.mark.slow),
        ("encoder_offset:ring=400", "starts_late", False),
        pytest.param("spool_wrong:ring=0.9", "starts_late", True, marks=pytest.mark.slow),
        pytest.param("encoder_offset:ring=-400", "bent", False, marks=pytest.mark.slow),
    ],
)
def test_zeros_spools_and_cables_are_found_on_their_finger(fault, check, homed):
    """Homing finds the zero anew, so a displaced one and a long cable are there on a hand that was not homed since."""
    result, _ = looked_at(Person(), unit="plausible:90221", fault=fault, homed=homed)
    assert ("ring", check) in found(result)
    assert {subject for subject, _ in found(result)} == {"ring"}


@pytest.mark.parametrize(("answers", "guarded"), drawn([(0, True), (1, False), (7, False)], 1))
def test_a_person_who_leaves_finds_the_hand_open(answers, guarded, tmp_path):
    person = Person(leaves_after=answers)
    result, codes = looked_at(person, unit="reference", homed=False, folder=tmp_path, guarded=guarded)
    assert result.end.kind is EndKind.INTERRUPTED
    assert str(result.end.error) == "the look was aborted; the hand is open"
    assert np.all(codes[: Channel.THUMB_ABDUCTION] < 1500)
    assert read_recording(tmp_path / "look.mcap").events[-1].text == "the look was ended; the hand is open"


def test_an_answer_is_a_number_or_a_name():
    asked = which_moved("")
    assert [asked.read(str(number)) for number in range(1, 8)] == [channel.label for channel in Channel]
    assert asked.read("Ring") == "ring"
    assert asked.read("thumb_flexor") == "thumb_flexor"
    assert asked.read("0") == asked.read("none") == "none"


GOOD = "y\n" + "".join(f"{number}\ny\n" for number in range(1, 8))


@pytest.mark.parametrize(
    ("typed", "code", "said"),
    [
        pytest.param("y\n1\nsometimes\n" + GOOD[4:], 0, "within limits", marks=pytest.mark.slow),
        (GOOD.replace("1\ny\n", "a\n2\ny\n"), 1, "Index finger: digit that moved in its place the middle finger"),
        pytest.param(
            GOOD.replace("y\n1", "n\ny\ny\nn\ny\ny\n1"),
            1,
            "Ring finger: open digit bent, should be straight",
            marks=pytest.mark.slow,
        ),
        ("y\n1\n", 130, "the look was aborted; the hand is open"),
    ],
)
def test_the_terminal_asks_and_ends_well(typed, code, said, tmp_path):
    arguments = ["validate", "--only", "presence", "--only", "look", "--zeros", "ideal", "--out", str(tmp_path)]
    result = CliRunner().invoke(main, arguments, input=typed)
    assert result.exit_code == code, result.output
    assert said in " ".join(result.output.split())


def test_nobody_looks_without_being_asked():
    with open_target("emulated") as target, pytest.raises(Exception, match="nobody looks at the hand"):
        validate(target, ["look"])
