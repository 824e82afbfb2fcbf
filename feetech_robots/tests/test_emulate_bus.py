"""`aero-hil emulate-bus` as a user starts it, and LeRobot's SO-101 follower on it."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import serial
from click.testing import CliRunner

from firmware_emulator.packets import pack
from hil.cli import main

ROOT = Path(__file__).parents[1]
ARM = ROOT / "examples/arm/arm.toml"
PATIENCE_S = 20.0


def start(*arguments):
    command = [sys.executable, "-m", "hil.cli", "emulate-bus", *map(str, arguments)]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=ROOT, stdin=pipe, stdout=pipe, stderr=pipe, text=True)


@pytest.mark.parametrize("echo", [False, True])
def test_a_robot_is_served_until_it_is_interrupted(tmp_path, echo):
    link = tmp_path / "arm"
    with start(ARM, "--link", link, *["--echo"] * echo) as process:
        assert process.stdout.readline() == f"ready {link}\n"
        with serial.Serial(str(link), 1_000_000, timeout=PATIENCE_S) as bus:
            for servo in range(1, 7):
                bus.write(pack(servo, 1))
                assert bus.read(6 + 6 * echo) == pack(servo, 1) * echo + pack(servo, 0)
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 0
    assert not link.is_symlink()


def test_orders_come_by_standard_input_and_its_end_ends_nothing(tmp_path):
    link = tmp_path / "arm"
    with start(ARM, "--link", link, "--orders") as process:
        assert process.stdout.readline() == f"ready {link}\n"
        process.stdin.write("silence 99 1\nheat 2 75\n")
        process.stdin.close()
        assert process.stdout.readline().startswith("refused: no servo with ID 99")
        with serial.Serial(str(link), 1_000_000, timeout=PATIENCE_S) as bus:
            for _ in range(50):
                bus.write(pack(2, 1))
                if bus.read(6)[4] == 0x04:
                    break
                bus.timeout = 0.02
                bus.read(1)
                bus.timeout = PATIENCE_S
            else:
                pytest.fail("the servo never says that it is hot")
        process.terminate()
        assert process.wait(PATIENCE_S) == 0


@pytest.mark.parametrize("by", ["</dev/null", "<&-"])
def test_orders_that_end_leave_the_server_idle(tmp_path, by):
    """As under systemd, nohup and CI. What its processor time is taken over is its own start, most of all."""
    command = f'exec "{sys.executable}" -m hil.cli emulate-bus "{ARM}" --orders {by}'
    with subprocess.Popen(["/bin/sh", "-c", command], cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        path = process.stdout.readline().split()[1]
        with serial.Serial(path, 1_000_000, timeout=PATIENCE_S) as bus:
            before = cpu_s(process.pid)
            bus.write(pack(1, 1))
            assert bus.read(6) == pack(1, 0)
            bus.timeout = 1.0
            bus.read(1)
            assert cpu_s(process.pid) - before < 0.5
        process.terminate()
        assert process.wait(PATIENCE_S) == 0


def cpu_s(process):
    spent = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(spent[11]) + int(spent[12])) / os.sysconf("SC_CLK_TCK")


def test_a_model_that_cannot_be_simulated_ends_with_one_line_and_exit_code_2(tmp_path):
    (tmp_path / "stiff.xml").write_text(
        '<mujoco><option timestep="0.02"/><worldbody><body><joint name="a" axis="0 1 0" stiffness="500"/>'
        '<geom size="0.01" mass="0.1"/></body></worldbody></mujoco>'
    )
    file = tmp_path / "stiff.toml"
    file.write_text('mjcf = "stiff.xml"\n[[servos]]\nid = 1\nmodel = "STS3215"\njoint = "a"\nstart_deg = 20\n')
    refused = CliRunner().invoke(main, ["emulate-bus", str(file)])
    assert refused.exit_code == 2
    _ready, said = refused.output.splitlines()
    assert said.startswith(f"Error: {tmp_path}/stiff.xml: MuJoCo cannot simulate it at joint 'a'")


@pytest.mark.parametrize(
    ("port", "said"),
    [("loop://", "fileno"), ("socket://host", "the address has no port"), ("/dev/no-such", "/dev/no-such")],
)
def test_a_port_that_cannot_be_served_is_one_line(port, said):
    done = CliRunner().invoke(main, ["emulate-bus", str(ARM), "--port", port])
    assert done.exit_code == 2
    assert done.output.startswith(f"Error: cannot serve the servo bus on '{port}': ")
    assert said in done.output


def test_a_file_that_is_no_robot_is_one_line_and_exit_code_2(tmp_path):
    file = tmp_path / "robot.toml"
    file.write_text("mjcf = 3\n")
    refused = CliRunner().invoke(main, ["emulate-bus", str(file)])
    assert refused.exit_code == 2
    assert refused.output.startswith(f"Error: {file}.mjcf: expected text, got 3")
    assert refused.output.count("\n") == 1


@pytest.mark.slow
@pytest.mark.parametrize("silent", [None, 3])
def test_lerobots_so101_follower_calibrates_configures_and_follows(silent):
    """Reads may come late on a loaded machine, but none may be lost, unless a servo is silent for 0.3 s."""
    python = os.environ.get("LEROBOT_PYTHON")
    if python is None:
        pytest.skip("needs LEROBOT_PYTHON, the interpreter of an environment with `lerobot[feetech]==0.6.*`")
    command = [python, str(ROOT / "examples/arm/so101_follower.py"), "--seconds", "10", "--aero-hil"]
    command += [str(Path(sys.executable).parent / "aero-hil")]
    if silent is not None:
        command += ["--silent", str(silent)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120.0)
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout)
    assert bool(found["lost"]) is (silent is not None)
    assert max(found["error_rms"].values()) < 6.0
