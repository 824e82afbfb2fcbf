"""`aero-hil … | head -1`: a closed pipe ends the printing, and neither the run nor its exit code."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HEAD = shutil.which("head", path=os.defpath)


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
@pytest.mark.parametrize(("fault", "code"), [([], 0), (["--fault", "motor_dead:ring"], 1)])
def test_a_closed_pipe_ends_the_printing_only(tmp_path, stream, fault, code):
    reading, writing = os.pipe()
    os.close(reading)
    out = tmp_path / "out"
    command = [sys.executable, "-P", "-m", "hil.cli", "validate", "--only", "staircase", "--out", str(out), *fault]
    if not fault:
        command[command.index("staircase")] = "presence"
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
