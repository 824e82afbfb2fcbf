"""`aero-hil diagnose` goes through the steps of a case, and ends with the part that one has convicted."""

import html
import sys
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from aero.channels import Channel
from aero.exit_code import Exit
from hil.cli import diagnose, main
from hil.dialogue.case_session import CaseSession
from hil.emulated.any_hand import open_target
from hil.emulated.emulated_case import emulated_hand
from hil.recordings.errors import NotOneHandError, UnusableFileError
from hil.targets import opening
from hil.verdict import validation
from hil.verdict.case import DiagnosisCase, Done
from hil.verdict.case_file import HandOfCase, StoredCase, read_case, write_case
from hil.verdict.failures import Failures
from hil.verdict.group import AmbiguityGroup, Proposal
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.steps import StepOutcome, steps

RING = frozenset({Suspect(Part.SERVO, Channel.RING), Suspect(Part.DIGIT, Channel.RING)})
NAMED = Done(Proposal(steps()["version"]), (StepOutcome.NO,))
EMPTIED = Done(Proposal(steps()["home"]), (StepOutcome.STAYS,))
"""Emptying and homing the hand comes after the question about the version, and a look at the cable next."""


def case_in(tmp_path, *done):
    """Write a case of the ring finger, as a run that failed leaves it."""
    failed = Failures({("audit", "followed", "ring"): -9.0, ("audit", "pull", "ring"): 3.0})
    ran = ("presence", "audit")
    group = AmbiguityGroup(failed, RING | {Suspect(Part.SETUP)})
    case = DiagnosisCase((group,), ran, ran, (NAMED, *done))
    write_case(tmp_path, StoredCase(case, HandOfCase("0.2.0", "right")))
    return tmp_path


@pytest.fixture
def folder(tmp_path):
    return case_in(tmp_path)


def diagnosed(folder, typed):
    return CliRunner().invoke(main, ["diagnose", str(folder), "--hil", "/dev/nowhere"], input=typed)


def test_what_a_person_sees_convicts_without_another_run(tmp_path):
    folder = case_in(tmp_path, EMPTIED)
    ended = diagnosed(folder, "n\n\ny\nthe spring is off\ns\n")
    assert ended.exit_code == Exit.OUT_OF_LIMITS
    assert "Digit of the ring finger." in ended.output
    *_, done, _mend = read_case(folder).case.done
    assert (done.outcomes, done.note) == ((StepOutcome.YES,), "the spring is off")
    assert (folder / "case.html").is_file()
    assert ended.output.rstrip().endswith("case.html")


@contextmanager
def emulated(_hand, **_fields):
    with open_target(homed=True) as target:
        yield target


def test_where_a_person_sees_nothing_the_experiments_are_run(folder, monkeypatch):
    monkeypatch.setattr(diagnose, "open_hand", emulated)
    ended = diagnosed(folder, "y\ndone\n")
    assert ended.exit_code == Exit.WITHIN_LIMITS
    assert "leave out of the hand what was taken away" in " ".join(ended.output.split())
    assert (folder / "step-2" / "audit.mcap").is_file()
    # The page of a step leads back to the case, and opens none of its own.
    page = html.unescape((folder / "step-2" / "report.html").read_text())
    assert f"aero-hil diagnose {folder} --hil /dev/nowhere" in page
    assert not (folder / "step-2" / "case.json").exists()


@pytest.mark.parametrize("target", ["emulated", "pty"])
def test_a_hand_that_is_gone_with_its_program_is_refused(target, folder):
    ended = CliRunner().invoke(main, ["diagnose", str(folder), "--hil", target])
    assert ended.exit_code == Exit.USAGE
    assert "leave it out" in ended.output


def test_ctrl_c_in_the_middle_of_a_run_puts_the_case_down(folder, monkeypatch):
    def interrupt(*_args):
        raise KeyboardInterrupt

    monkeypatch.setattr(diagnose, "open_hand", emulated)
    monkeypatch.setattr(validation, "_run", interrupt)
    ended = diagnosed(folder, "n\ndone\n")
    assert ended.output.count("next step") == 1
    assert "the same command resumes" in ended.output
    assert read_case(folder).case.done == (NAMED,)
    assert "Open case" in (folder / "case.html").read_text()


def test_before_the_hand_moves_it_is_said_with_how_long(folder):
    said = " ".join(diagnosed(folder, "n\n").output.split())
    assert "The hand homes (about 8 s). Runs audit (about" in said
    assert "Fingers and thumb will close" in said
    assert "Keep clear. Ctrl-C opens the hand." in said


def test_a_case_that_is_put_down_is_taken_up_where_it_was(tmp_path):
    folder = case_in(tmp_path, EMPTIED)
    put_down = diagnosed(folder, "n\n")
    assert put_down.exit_code not in (Exit.WITHIN_LIMITS, Exit.OUT_OF_LIMITS)
    assert "the same command resumes" in put_down.output
    assert read_case(folder).case.done == (NAMED, EMPTIED)
    assert "what was measured" not in put_down.output
    assert list(read_case(folder).answers.values()) == ["no"]
    again = diagnosed(folder, "alike\n")
    assert "answered" in again.output
    *_, done = read_case(folder).case.done
    assert (done.outcomes, done.note) == ((StepOutcome.NO,), "alike")


def test_a_stored_answer_that_its_question_does_not_have_is_asked_again(tmp_path):
    folder = case_in(tmp_path, EMPTIED)
    diagnosed(folder, "n\n")
    (folder / "case.json").write_text((folder / "case.json").read_text().replace('"no"', '"perhaps"'))
    diagnosed(folder, "n\nalike\n")
    *_, done = read_case(folder).case.done
    assert (done.outcomes, done.note) == ((StepOutcome.NO,), "alike")


@pytest.mark.parametrize(
    ("table", "refused"),
    [
        ('side = "left"', "side right, connected is left"),
        ('firmware = "0.1.5"', "firmware"),
        ('side = "right"', "name unknown, connected is bench"),
    ],
)
def test_another_hand_is_refused_before_anything_is_asked(table, refused, monkeypatch, tmp_path):
    """A case of a right hand drove a left one once, and said that the failure was gone."""
    folder = case_in(tmp_path, EMPTIED)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hands.toml").write_text(f'[bench]\nport = "/dev/nowhere"\n{table}\n')
    ended = CliRunner().invoke(main, ["diagnose", str(folder), "--hil", "bench"], input="y\n\n")
    assert ended.exit_code == Exit.USAGE
    assert refused in ended.output
    same = CliRunner().invoke(main, ["diagnose", str(folder), "--hil", "bench", "--same-hand"], input="y\n\nn\n\ns\n")
    assert same.exit_code == Exit.OUT_OF_LIMITS


def test_a_serial_number_decides_over_a_name():
    hand = HandOfCase("0.2.0", "right", "bench-right", "A1")
    hand.require_same({"hand_id": "bench-new", "serial_number": "A1"})
    for other in ({"serial_number": "B2", "hand_id": "bench-right"}, {"hand_id": "bench-left", "serial_number": ""}):
        with pytest.raises(NotOneHandError, match="--same-hand"):
            hand.require_same(other)


@pytest.mark.parametrize(("known", "said"), [("", "bench"), ("bench", ""), ("A1", "bench")])
def test_an_unknown_name_is_no_name_of_every_hand(known, said):
    with pytest.raises(NotOneHandError, match="belongs to another hand: name"):
        HandOfCase("0.2.0", "right", known).require_same({"hand_id": said, "serial_number": ""})
    HandOfCase("0.2.0", "right", "").require_same({"hand_id": "", "serial_number": ""})


def test_the_serial_number_that_a_cp2102_has_as_delivered_identifies_no_hand(monkeypatch):
    for number, kept in (("0001", ""), ("F412FA", "F412FA")):
        found = SimpleNamespace(device="/dev/null", serial_number=number)
        monkeypatch.setattr(opening, "comports", lambda found=found: [found])
        assert opening.serial_number("/dev/null") == kept


def run_words(*words):
    return CliRunner().invoke(main, list(map(str, words)))


@pytest.mark.slow
def test_a_case_of_an_emulated_hand_keeps_its_zeros(tmp_path):
    """A staircase with ideal zeros failed, and the rerun with homed ones said that the failure was gone."""
    words = ("--only", "presence", "--only", "staircase", "--zeros", "ideal", "--fault", "cable_long:ring=0.002")
    assert run_words("validate", *words, "--out", tmp_path).exit_code == Exit.OUT_OF_LIMITS
    assert emulated_hand(read_case(tmp_path).hand).homed is False


def test_a_case_names_the_files_of_its_hand_and_opens_none(tmp_path, monkeypatch):
    (tmp_path / "lab").mkdir()
    monkeypatch.chdir(tmp_path / "lab")
    Path("mine.toml").write_text("[servos]\nstart_temperature_c = 30.0\n")
    named = ("--unit", "mine.toml", "--out", tmp_path / "run")
    healthy = run_words("validate", "--only", "presence", "--unit", "mine.toml", "--out", tmp_path / "good")
    assert healthy.exit_code == 0, healthy.output
    assert run_words("baseline", tmp_path / "good", "base").exit_code == 0
    faulty = run_words("validate", "--only", "presence", "--fault", "servo_missing:ring", "--baseline", "base", *named)
    assert faulty.exit_code == Exit.OUT_OF_LIMITS
    files = f"--unit {tmp_path}/lab/mine.toml --baseline {tmp_path}/lab/base"
    assert f"aero-hil diagnose {tmp_path}/run {files}" in faulty.output.replace("\n", "")
    monkeypatch.chdir(tmp_path)
    ended = run_words("diagnose", tmp_path / "run")
    assert ended.exit_code == Exit.USAGE
    assert f"add {files}" in ended.output
    assert "has no --firmware-program" in run_words("diagnose", "run", "--firmware-program", sys.executable).output
    begun = CliRunner().invoke(main, ["diagnose", str(tmp_path / "run"), *files.split()], input="")
    assert "next step" in begun.output


def test_a_case_that_another_program_edits_at_a_prompt_is_not_overwritten(tmp_path):
    case_in(tmp_path)
    session = CaseSession(read_case(tmp_path), tmp_path, None, None)
    edited = (tmp_path / "case.json").read_text().replace('"answers": {}', '"answers": {"asked": "yes"}')
    (tmp_path / "case.json").write_text(edited)
    with pytest.raises(UnusableFileError, match="changed by another program"):
        session._store(session.stored)
    assert (tmp_path / "case.json").read_text() == edited
