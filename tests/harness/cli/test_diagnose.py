"""`aero-hil diagnose` goes through the steps of a case, and ends with the part that one has convicted."""

import html
import re
from contextlib import contextmanager

import pytest
from click.testing import CliRunner

from aero.channels import Channel
from aero.exit_code import Exit
from hil import open_target
from hil.cli import diagnose, main
from hil.faults import parse_fault
from hil.verdict import validation
from hil.verdict.case import DiagnosisCase
from hil.verdict.case_file import HandOfCase, read_case, write_case
from hil.verdict.failures import Failures
from hil.verdict.parts import Part, Suspect
from hil.verdict.steps import StepOutcome

RING = {Suspect(Part.SERVO, Channel.RING): 0.45, Suspect(Part.DIGIT, Channel.RING): 0.43, Suspect(Part.SETUP): 0.12}


@pytest.fixture
def folder(tmp_path):
    """A folder with a case of the ring finger, as a run that failed leaves it."""
    failed = Failures({("audit", "followed", "ring"): -9.0, ("audit", "pull", "ring"): 3.0})
    write_case(tmp_path, DiagnosisCase(failed, RING, ("presence", "audit")), HandOfCase("0.2.0", "right"))
    return tmp_path


def diagnosed(folder, typed):
    return CliRunner().invoke(main, ["diagnose", str(folder), "--hil", "/dev/nowhere"], input=typed)


def test_what_a_person_sees_convicts_without_another_run(folder):
    ended = diagnosed(folder, "y\nthe spring is off\n")
    assert ended.exit_code == Exit.OUT_OF_LIMITS
    assert "Digit of the ring finger." in ended.output
    (done,) = read_case(folder)[0].done
    assert (done.outcome, done.note) == (StepOutcome.SEEN, "the spring is off")
    assert (folder / "case.html").is_file()


@contextmanager
def emulated(_hand):
    with open_target(homed=True) as target:
        yield target


def test_where_a_person_sees_nothing_the_experiments_are_run(folder, monkeypatch):
    monkeypatch.setattr(diagnose, "open_hand", emulated)
    ended = diagnosed(folder, "n\n\ny\n\n")
    assert ended.exit_code == Exit.WITHIN_LIMITS
    assert "leave the hand as it is" in ended.output
    assert (folder / "step-1" / "audit.mcap").is_file()
    # The page of a step leads back to the case, and opens none of its own.
    page = html.unescape((folder / "step-1" / "report.html").read_text())
    assert f"aero-hil diagnose {folder} --hil /dev/nowhere" in page
    assert not (folder / "step-1" / "case.json").exists()


@pytest.mark.parametrize("target", ["emulated", "pty"])
def test_a_hand_that_is_gone_with_its_program_is_refused(target, folder):
    ended = CliRunner().invoke(main, ["diagnose", str(folder), "--hil", target])
    assert ended.exit_code == Exit.USAGE
    assert "give its port" in ended.output


def test_where_other_checks_fail_still_it_is_said_with_what_is_gone(folder, monkeypatch):
    with open_target(faults=[parse_fault("motor_dead:index")]) as target:
        run = validation.validate(target, ["audit"])
    monkeypatch.setattr(diagnose, "open_hand", emulated)
    monkeypatch.setattr(diagnose, "rerun", lambda *_, **__: (StepOutcome.GONE, run))
    diagnosed(folder, "n\nalike\nn\n\n")
    (done,) = read_case(folder)[0].done
    assert re.fullmatch(r"alike; elsewhere \d+ checks fail still, so validate again", done.note)
    assert done.note in (folder / "case.html").read_text()


def test_ctrl_c_in_the_middle_of_a_run_puts_the_case_down(folder, monkeypatch):
    def interrupt(*_args):
        raise KeyboardInterrupt

    monkeypatch.setattr(diagnose, "open_hand", emulated)
    monkeypatch.setattr(validation, "_run", interrupt)
    ended = diagnosed(folder, "n\n\nn\n\n" * 2)
    assert ended.output.count("next step") == 1
    assert "takes it up" in ended.output
    assert read_case(folder)[0].done == ()
    assert "Open case" in (folder / "case.html").read_text()


def test_before_the_hand_moves_it_is_said_with_how_long(folder):
    said = " ".join(diagnosed(folder, "n\n\nn\n").output.split())
    assert re.search(r"runs presence, audit \(\d+ s\)", said)
    assert "the hand has power; it then homes and moves, so keep clear" in said


def test_a_case_that_is_put_down_is_taken_up_where_it_was(folder):
    put_down = diagnosed(folder, "n\n")
    assert put_down.exit_code not in (Exit.WITHIN_LIMITS, Exit.OUT_OF_LIMITS)
    assert "takes it up" in put_down.output
    assert read_case(folder)[0].done == ()
    assert diagnosed(folder, "y\n\n").exit_code == Exit.OUT_OF_LIMITS
