"""What is typed or clicked is done to the hand that `emulate` serves."""

import os
import subprocess
import sys

import numpy as np
import pytest

from aero import Channel
from aero.channels import WIRE_ORDER
from aero.protocol import make_positions
from firmware_emulator.links.pty import PtyServer
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults.acts import ACTS
from hil.emulated.hands_on import COMMAND, IDLE_S, HandsOn
from hil.recordings.mcap_file import read_recording
from model.units import load_unit

PATIENCE_S = 60.0


@pytest.fixture
def served():
    electronics, workbench = build_emulated(load_unit("reference"), EmulatedSpec(seed=3))
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
        ("inject gremlin", "unknown fault 'gremlin'"),
        ("inject host_stalls", "the program's end"),
        ("dance", "unknown act 'dance'"),
        ("command ring fast", "usage: command CHANNEL PERCENT"),
        ("command", "unknown channel ''"),
        ("command ring", "usage: command CHANNEL PERCENT"),
        ("command ring 40 50", "usage: command CHANNEL PERCENT"),
        ("command ring nan", "usage: command CHANNEL PERCENT"),
        ("inject encoder_noise=1e300", "goes from 0 to 1024 counts rms"),
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


def wait(electronics, seconds):
    electronics.clock.sleep_until(electronics.clock.now() + seconds)


@pytest.mark.parametrize("firmware", ["0.1.0", "0.2.0"])
def test_a_slider_leaves_the_other_channels_where_they_were_told_to_go(firmware):
    """Whoever told them: a program, two sliders at once, or nobody while the servos were without torque."""
    electronics, workbench = build_emulated(load_unit("reference"), EmulatedSpec(seed=3, firmware=firmware))
    hands_on = HandsOn(workbench, lambda text, severity: pytest.fail(text))
    closed = np.array([50_000, 40_000, 30_000, 20_000, 10_000, 15_000, 25_000])
    electronics.receive(make_positions(closed))
    wait(electronics, IDLE_S)
    goals = [servo.memory.get("goal_position") for servo in electronics.servos]
    for _ in range(20):  # a rounding that adds up would show
        for line in ("command ring 80", "command pinky 70"):
            hands_on.put(line)
        hands_on.serve()
        wait(electronics, 0.2)
    moved = [WIRE_ORDER.index(channel) for channel in (Channel.RING, Channel.PINKY)]
    after = [servo.memory.get("goal_position") for servo in electronics.servos]
    assert [at for at in range(7) if after[at] != goals[at]] == moved
    words = electronics.commanded_words()
    assert [words[at] / 65535 for at in moved] == pytest.approx([0.8, 0.7], abs=1e-3)


def test_help_is_one_message_with_every_act(served):
    hands_on, _, _, told = served
    hands_on.put("help")
    hands_on.serve()
    ((_, text),) = told
    assert [line.split()[0].rstrip(":") for line in text.splitlines()] == [*ACTS, COMMAND]


def test_two_restarts_at_once_take_the_port_away_once(served):
    _, workbench, electronics, _ = served
    with PtyServer(electronics) as server:
        waited = iter([False, True])

        def stop():
            workbench.power_on()
            workbench.power_on()
            return next(waited)

        server.run(stop)


def test_emulate_leaves_the_standard_input_of_a_script_alone():
    """As in a shell's `while read`: what is in the pipe is still there afterwards."""
    reading, writing = os.pipe()
    os.write(writing, b"inject motor_dead:ring\n")
    command = [sys.executable, "-m", "hil.cli", "emulate"]
    with subprocess.Popen(command, text=True, stdin=reading, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline().startswith("ready ")
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(0.5)
        process.terminate()
        process.communicate(timeout=PATIENCE_S)
    assert os.read(reading, 100) == b"inject motor_dead:ring\n"
    os.close(reading)
    os.close(writing)


def test_words_typed_into_emulate_are_in_its_recording(tmp_path):
    command = [sys.executable, "-m", "hil.cli", "emulate", "--prompt", "--record", str(tmp_path / "hand.mcap")]
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
