"""What is typed or clicked is done to the hand that `emulate` serves."""

import subprocess
import sys

import pytest

from aero import Channel
from hil.cli.hands_on import IDLE_S, HandsOn
from hil.recordings.mcap_file import read_recording
from hil.targets.emulated_hand import build_emulated
from hil.targets.hand_spec import HandSpec
from model.units import load_unit

PATIENCE_S = 60.0


@pytest.fixture
def served():
    electronics, workbench = build_emulated(load_unit("reference"), HandSpec(seed=3))
    workbench.at_a_port = True
    told = []
    return HandsOn(workbench, lambda text, severity: told.append((severity, text))), workbench, electronics, told


def test_words_are_done_in_the_thread_that_serves_and_told_once(served):
    hands_on, workbench, _, told = served
    hands_on.put("inject motor_dead:ring")
    assert workbench.present == ()
    hands_on.serve()
    hands_on.serve()
    assert [str(fault) for fault in workbench.present] == ["motor_dead:ring=1.0"]
    assert told == [("info", "injected motor_dead:ring=1.0")]


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("inject gremlin", "there is no fault 'gremlin'"),
        ("inject host_stalls", "the program's end"),
        ("dance", "there is no act 'dance'"),
        ("command ring fast", "it is written command CHANNEL PERCENT"),
        ("command", "there is no channel ''"),
    ],
)
def test_what_cannot_be_done_is_told(line, says, served):
    hands_on, _, _, told = served
    hands_on.put(line)
    hands_on.serve()
    ((severity, text),) = told
    assert (severity, says in text) == ("error", True), text


def test_a_slider_moves_its_channel_unless_a_program_commands(served):
    hands_on, workbench, electronics, told = served
    hands_on.put("command ring 60")
    hands_on.serve()
    electronics.clock.sleep_until(electronics.clock.now() + 2.0)
    electronics.advance_plant()
    joints = workbench.mechanics.joint_angles()
    assert joints[3 * Channel.RING] > 0.3 > joints[3 * Channel.PINKY]
    hands_on.heard((electronics.kernel.now, ">", b"\x22"))
    hands_on.put("command ring 0")
    hands_on.serve()
    assert told[-1][1].startswith("a program commands the hand")
    electronics.clock.sleep_until(electronics.clock.now() + IDLE_S)
    hands_on.put("command ring 0")
    hands_on.serve()
    assert len(told) == 1


def test_words_typed_into_emulate_are_in_its_recording(tmp_path):
    command = [sys.executable, "-m", "hil.cli", "emulate", "--record", str(tmp_path / "hand.mcap")]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:
        assert process.stdout.readline().startswith("ready ")
        process.stdin.write("inject motor_dead:ring\nclear motor_weak\n")
        process.stdin.flush()
        said = [process.stderr.readline(), process.stderr.readline()]
        process.terminate()
        process.communicate(timeout=PATIENCE_S)
    assert {line.partition(":")[0].partition(";")[0].strip() for line in said} == {
        "injected motor_dead",
        "the hand does not have motor_weak",
    }
    events = [event.text for event in read_recording(tmp_path / "hand.mcap").events]
    assert "injected motor_dead:ring=1.0" in events
