"""Each diagnosis has one to three causes and one test, for the place it is about and the hand that was measured."""

import shlex
from dataclasses import replace

import pytest
from click.testing import CliRunner

from aero.channels import Channel
from hil.cli import main
from hil.recordings.recording import Header
from hil.verdict.diagnosis import Component, Location, command_again, filled, hand_options, on_hand, rows
from hil.verdict.rules import Failures, rule_for
from hil.verdict.run_end import FINISHED

EMULATED = Header(
    "audit", "emulated", "left", "0.1.5", "paper", "homed", "plausible:7", 3, faults="motor_weak:ring=0.5"
)
ON_A_PORT = Header("audit", "/dev/my hand", "right", "0.2.0", "paper", "homed", "physical", 0)
RING = Location(Component.CHANNEL, (Channel.RING,))


def test_every_diagnosis_has_one_to_three_causes_and_one_test():
    for name, row in rows().items():
        assert 1 <= len(row.causes) <= 3, name
        assert row.test.endswith("."), name


@pytest.mark.parametrize("location", [None, RING, Location(Component.CHANNEL, (Channel.THUMB_CMC_FLEXION,))])
@pytest.mark.parametrize("header", [EMULATED, ON_A_PORT])
def test_every_command_is_one_that_exists(header, location):
    for row in rows().values():
        command = filled(row.command, location, header)
        assert "{" not in filled(row.test, location, header) + command
        if command:
            program, *words = shlex.split(command)
            assert program == "aero-hil"
            asked = [word if word not in ("ADAPTER", "PORT", "SERVO") else "0" for word in words]
            result = CliRunner().invoke(main, [*asked, "--help"])
            assert result.exit_code == 0, (command, result.output)


def test_a_channel_that_stands_still_is_not_a_late_hand():
    """Of a dead motor the time from command to motion cannot be measured, which counts as out of limits."""
    off = {
        ("response", "command_to_motion", "hand"): 3.0, ("audit", "followed", "ring"): -87.0,
        ("audit", "pull", "ring"): -3.2, ("excursion", "closed_percent", "ring"): -600.0,
    }  # fmt: skip
    assert rule_for(Failures(off, {}), FINISHED) == (RING, "no_power")
    late = {("response", "command_to_motion", "hand"): 3.0}
    assert rule_for(Failures(late, {}), FINISHED)[1] == "late_servos"


def test_the_finger_and_its_servo_are_named():
    weak = rows()["weak"]
    assert "the ring finger" in filled(weak.test, RING, ON_A_PORT)
    assert filled(weak.command, RING, ON_A_PORT) == "aero-hil servos --port ADAPTER show 5"


def test_a_command_names_the_hand_that_was_measured():
    options = " --firmware 0.1.5 --hand left --unit plausible:7 --seed 3 --fault motor_weak:ring=0.5"
    assert hand_options(EMULATED) == options
    assert hand_options(ON_A_PORT) == " --hil '/dev/my hand'"
    said = on_hand("Run `aero-hil validate --only audit`.", ON_A_PORT)
    assert said == "Run `aero-hil validate --hil '/dev/my hand' --only audit`."


def test_what_a_person_interrupted_is_run_again_as_it_was():
    header = replace(ON_A_PORT, target="pty", unit="reference", command="aero-hil validate --hil pty")
    assert command_again(header) == "aero-hil validate --hil pty"
    assert command_again(ON_A_PORT) == "aero-hil validate --hil '/dev/my hand'"
