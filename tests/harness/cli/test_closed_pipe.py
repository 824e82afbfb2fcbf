"""A closed pipe (`aero-hil … | head -1`), terminal or stream ends the printing, and does not change the exit code."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hil.recordings.mcap_file import read_recording

HEAD = shutil.which("head", path=os.defpath)


@pytest.mark.parametrize(
    ("stream", "fault", "code"), [("stdout", ["--fault", "motor_dead:ring"], 1), ("stderr", [], 0)]
)
def test_a_closed_pipe_ends_the_printing_only(tmp_path, stream, fault, code):
    reading, writing = os.pipe()
    os.close(reading)
    out = tmp_path / "out"
    command = [sys.executable, "-P", "-m", "hil.cli", "validate", "--only", "audit", "--out", str(out), *fault]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, stream: writing}
    done = subprocess.run(command, **pipes, text=True, check=False)
    os.close(writing)
    said = (done.stdout or "") + (done.stderr or "")
    assert (done.returncode, (out / "report.html").is_file()) == (code, True), said
    assert "Broken pipe" not in said


@pytest.mark.skipif(not Path("/bin/bash").exists() or not HEAD, reason="needs bash and head")
def test_a_script_that_reads_one_line_gets_it(tmp_path):
    command = f"{sys.executable} -P -m hil.cli faults | {HEAD} -n 1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["/bin/bash", "-c", command], capture_output=True, text=True, check=False)
    assert (done.returncode, len(done.stdout.splitlines()), done.stderr) == (0, 1, "")


@pytest.mark.skipif(not Path("/bin/bash").exists(), reason="needs bash")
@pytest.mark.parametrize("closed", ["<&-", ">&- 2>&- <&-"])
def test_streams_that_the_shell_closed_change_nothing(tmp_path, closed):
    command = f"{sys.executable} -P -m hil.cli validate --only presence --out {tmp_path / 'out'} {closed}"
    done = subprocess.run(["/bin/bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    # A recording that took the free descriptor would hold what was printed.
    assert read_recording(tmp_path / "out" / "presence.mcap").header.finished


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a system without pseudo-terminals")
@pytest.mark.parametrize(
    "command",
    [
        ["validate", "--only", "staircase"],
        ["run-policy", "--hil", "pty", "--wait", "0"],
        ["run-policy", "--empty", "--wait", "0"],
    ],
)
def test_a_terminal_that_is_closed_ends_the_command_as_its_signal(tmp_path, command):
    reader, terminal = os.openpty()
    running = subprocess.Popen(
        [sys.executable, "-P", "-m", "hil.cli", *command], stdin=terminal, stdout=terminal, stderr=terminal,
        cwd=tmp_path, start_new_session=True,
    )  # fmt: skip
    os.close(terminal)
    said = b""
    while b"%" not in said:  # the bar: the hand moves
        said += os.read(reader, 4096)
    os.close(reader)
    running.send_signal(signal.SIGHUP)  # as the system does to the session of a terminal
    assert running.wait(60) in (128 + signal.SIGHUP, -signal.SIGHUP)
