"""Each cause has one thing to do, for the finger that it sits on and the hand that was measured."""

import shlex
from dataclasses import replace

import pytest
from click.testing import CliRunner

from aero.channels import Channel
from hil.cli import main
from hil.faults import CATALOGUE
from hil.recordings.recording import Header
from hil.verdict.explanation import Explanation
from hil.verdict.next_step import advised, command_again, hand_options, on_hand, servo_id, step_for

EMULATED = Header(
    "audit", "emulated", "left", "0.1.5", "paper", "homed", "plausible:7", 3, faults="motor_weak:ring=0.5"
)
ON_A_PORT = Header("audit", "/dev/my hand", "right", "0.2.0", "paper", "homed", "physical", 0)


def test_every_cause_has_a_name_and_one_thing_to_do():
    known = {kind.cause for kind in CATALOGUE.values()} | {"driver_or_map"}
    assert advised().keys() == known
    for cause, row in advised().items():
        assert row.name, cause
        assert row.do.endswith("."), cause
        assert "_" not in row.name, cause


@pytest.mark.parametrize("channel", [None, Channel.RING, Channel.THUMB_CMC_FLEXION])
@pytest.mark.parametrize("header", [EMULATED, ON_A_PORT])
def test_every_command_is_one_that_exists(header, channel):
    for cause in advised():
        step = step_for(Explanation(cause, channel, 0.9, None), header)
        assert step is not None
        assert "{" not in step.do + step.command
        if step.command:
            program, *words = shlex.split(step.command)
            assert program == "aero-hil"
            asked = [word if word not in ("ADAPTER", "PORT", "SERVO") else "0" for word in words]
            result = CliRunner().invoke(main, [*asked, "--help"])
            assert result.exit_code == 0, (step.command, result.output)


def test_the_finger_and_its_servo_are_named():
    step = step_for(Explanation("protection_low", Channel.RING, 0.9, None), ON_A_PORT)
    assert "servo of the ring finger" in step.do
    assert step.command == "aero-hil servos --port ADAPTER show 5"


@pytest.mark.parametrize(("channel", "number"), [(Channel.THUMB_ABDUCTION, 0), (Channel.INDEX, 3), (Channel.PINKY, 6)])
def test_ids_are_places_on_the_wire(channel, number):
    """The board reads servos 0 to 6 into a reply: thumb abduction, CMC flexion, flexor, then the fingers."""
    assert servo_id(channel) == number


def test_a_command_names_the_hand_that_was_measured():
    options = " --firmware 0.1.5 --hand left --unit plausible:7 --seed 3 --fault motor_weak:ring=0.5"
    assert hand_options(EMULATED) == options
    assert hand_options(ON_A_PORT) == " --hil '/dev/my hand'"
    said = on_hand("Run `aero-hil validate --only audit`.", ON_A_PORT)
    assert said == "Run `aero-hil validate --hil '/dev/my hand' --only audit`."


def test_what_a_person_broke_off_is_run_again_as_it_was():
    header = replace(ON_A_PORT, target="pty", unit="reference", command="aero-hil validate --hil pty")
    assert command_again(header) == "aero-hil validate --hil pty"
    assert command_again(ON_A_PORT) == "aero-hil validate --hil '/dev/my hand'"


def test_a_cause_that_nothing_is_known_about_has_no_step():
    assert step_for(Explanation("gremlins", None, 0.9, None), EMULATED) is None
