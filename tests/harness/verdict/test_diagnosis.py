"""What is said of a failed run, and the commands that repeat it or go on from it."""

from pathlib import Path

import pytest

from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.recordings.recording import Header
from hil.verdict.diagnosis import command_again, command_of_case
from hil.verdict.failures import Failures
from hil.verdict.judge import homed_badly
from hil.verdict.validation import validate


def test_what_a_person_interrupted_is_run_again_as_it_was():
    command = "/usr/bin/aero-hil validate --hil pty"
    header = Header("audit", "pty", "right", "0.2.0", "paper", "homed", "physical", 0, command=command)
    assert command_again(header) == "aero-hil validate --hil pty"
    in_a_program = Header("audit", "emulated", "right", "0.2.0", "paper", "homed", "reference", 0)
    assert command_again(in_a_program) == ""


@pytest.mark.parametrize(
    ("target", "folder", "command"),
    [
        ("/dev/ttyACM0", Path("my run"), "aero-hil diagnose 'my run' --hil /dev/ttyACM0"),
        ("/dev/ttyACM0", None, "aero-hil diagnose --hil /dev/ttyACM0"),
        ("pty", Path("run"), "aero-hil diagnose run"),
        ("emulated", None, "aero-hil diagnose"),
    ],
)
def test_a_case_is_taken_up_where_it_was_written(target, folder, command):
    header = Header("audit", target, "right", "0.2.0", "paper", "homed", "physical", 0)
    assert command_of_case(header, folder) == command


def test_another_version_that_explains_the_run_is_named_and_leads_to_a_case():
    with open_target(firmware="0.1.5", homed=True, faults=[parse_fault("board_runs_0.2.0")]) as target:
        found = validate(target, ["excursion", "coupling"]).diagnosis
    assert found.sentence.startswith("It reads as firmware 0.2.0 or main, or as a board not homed. Suspected: ")
    assert found.step.command.startswith("aero-hil diagnose")


@pytest.mark.slow
def test_what_most_channels_share_is_said_once():
    with open_target(homed=True) as target:
        target.act("hold")
        target.hand.home()
        said = validate(target, ["audit", "holding", "staircase"]).diagnosis
    assert said.place == "parts that all digits share"
    assert "everal digits fail" in said.sentence
    assert "readings of the" not in said.sentence


@pytest.mark.parametrize(
    ("off", "badly"),
    [
        ({("staircase", "excursion_hand", "thumb_flexor"): -2.0}, True),
        ({("staircase", "excursion_hand", "thumb_flexor"): -2.0, ("audit", "followed", "thumb_abduction"): 3.0}, True),
        ({("staircase", "excursion_hand", "thumb_flexor"): -2.0, ("staircase", "spring", "thumb_flexor"): 3.0}, False),
        ({("staircase", "excursion_hand", "ring"): -2.0}, False),
        ({}, False),
    ],
)
def test_travel_of_the_thumb_alone_asks_for_another_homing(off, badly):
    assert homed_badly(Failures(off, frozenset(off))) is badly
