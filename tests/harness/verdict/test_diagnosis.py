"""Commands that name the hand that was measured."""

from dataclasses import replace

from hil.recordings.recording import Header
from hil.verdict.diagnosis import command_again, hand_options

EMULATED = Header(
    "audit", "emulated", "left", "0.1.5", "paper", "homed", "plausible:7", 3, faults="motor_weak:ring=0.5"
)
ON_A_PORT = Header("audit", "/dev/my hand", "right", "0.2.0", "paper", "homed", "physical", 0)


def test_a_command_names_the_hand_that_was_measured():
    options = " --firmware 0.1.5 --hand left --unit plausible:7 --seed 3 --fault motor_weak:ring=0.5"
    assert hand_options(EMULATED) == options
    assert hand_options(ON_A_PORT) == " --hil '/dev/my hand'"


def test_what_a_person_interrupted_is_run_again_as_it_was():
    header = replace(ON_A_PORT, target="pty", unit="reference", command="aero-hil validate --hil pty")
    assert command_again(header) == "aero-hil validate --hil pty"
    assert command_again(ON_A_PORT) == "aero-hil validate --hil '/dev/my hand'"
