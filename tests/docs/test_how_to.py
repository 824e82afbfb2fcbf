"""The how-to pages: their commands work on emulated hands, as they stand there.

`tox -e realtime` runs them, because they take more than a few seconds.
"""

import os
import pty
import re
import select
import shlex
import shutil
import subprocess
import tty
from importlib import resources

import pytest
import yaml
from pages import blocks, environment, run

pytestmark = pytest.mark.slow


def done(command, folder):
    ran = run(command, folder)
    assert ran.returncode == 0, f"{command}\n{ran.stdout[-3000:]}"
    return ran.stdout


def test_the_workflow_for_ones_own_repository(tmp_path):
    workflow = yaml.safe_load(blocks("docs/ci.md", "yaml")[0])
    commands = [step["run"] for step in workflow["jobs"]["hand"]["steps"] if "run" in step]
    (tmp_path / "tests").mkdir()
    for snippet in blocks("docs/test_your_driver.md", "python"):
        name = re.match(r"# (test_\w+\.py)", snippet).group(1)
        (tmp_path / "tests" / name).write_text(snippet, encoding="utf-8")
    assert [command.split()[0] for command in commands] == ["pip", "aero-hil", "pytest"]
    for command in commands[1:]:
        done(command, tmp_path)
    assert {"report.html", "junit.xml"} <= {path.name for path in (tmp_path / "hand-report").iterdir()}


def test_several_hands(tmp_path):
    known, compared, emulated = blocks("docs/several_hands.md", "sh")[1:]
    done(emulated, tmp_path)
    for name, number in (("left-bench", 1), ("right-bench", 2)):
        shutil.move(tmp_path / "hands" / str(number), tmp_path / "hands" / name)
    unit = "--unit plausible:1 --seed 3 --only presence --only audit"
    assert "baseline known/left-bench" in done(known.replace("--hil /dev/ttyACM0", unit), tmp_path)
    assert "rms" in done(compared, tmp_path)


def test_your_policy(tmp_path):
    shipped = next(path for path in resources.files("aero.policy.shipped").iterdir() if path.name.startswith("steady"))
    shutil.copy(shipped, tmp_path / "mine.npz")
    lines = [line.partition("#")[0] for line in blocks("docs/your_policy.md", "sh")[1].splitlines()]
    emulated = [line for line in lines if "/dev/tty" not in line]
    assert len(emulated) == 3
    said = [done(line + (" --trials 1 --seconds 3" if "predict" in line else ""), tmp_path) for line in emulated]
    for row in ("ended because", "periods outside the command window", "lateness", "cube turned", "cube at the end"):
        assert row in said[1]
    assert "run-policy-twin" in said[2]


def test_emulated_servos(tmp_path):
    line = next(line for line in blocks("docs/emulated_servos.md", "sh")[0].splitlines() if "--bus-port" in line)
    board, adapter = pty.openpty()
    for end in (board, adapter):
        tty.setraw(end)
    command = shlex.split(line.replace("/dev/ttyUSB0", os.ttyname(adapter)))
    with subprocess.Popen(command, cwd=tmp_path, env=environment(), stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout.readline().startswith("ready")
            os.write(board, bytes.fromhex("FF FF 01 02 01 FB"))  # ping servo 1
            answer = b""
            while len(answer) < 6 and select.select([board], [], [], 5.0)[0]:
                answer += os.read(board, 64)
        finally:
            server.terminate()
    os.close(board)
    os.close(adapter)
    assert answer == bytes.fromhex("FF FF 01 02 00 FC")
