"""The command that a run that says nothing is repeated with."""

from hil.recordings.recording import Header
from hil.verdict.diagnosis import command_again


def test_what_a_person_interrupted_is_run_again_as_it_was():
    command = "/usr/bin/aero-hil validate --hil pty"
    header = Header("audit", "pty", "right", "0.2.0", "paper", "homed", "physical", 0, command=command)
    assert command_again(header) == "aero-hil validate --hil pty"
    in_a_program = Header("audit", "emulated", "right", "0.2.0", "paper", "homed", "reference", 0)
    assert command_again(in_a_program) == ""
