"""A child that is silent, stopped, talkative or dead costs its parent a limited time, and is gone afterwards."""

import os
import signal
import subprocess
import sys

import pytest

from aero.child_process import ChildError, ChildProcess, python

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs signals")


def child(program, **settings):
    return ChildProcess([sys.executable, "-c", program], "the child", **settings)


def gone(process):
    with pytest.raises(ProcessLookupError):
        os.kill(process.pid, 0)


SLEEP = "import time; time.sleep(600)"


def test_what_follows_ready_is_returned_and_other_lines_go_elsewhere():
    lines = []
    process = child("print('late 1'); print('ready /dev/x y', flush=True); print('late 2')", on_line=lines.append)
    assert process.wait_ready(30.0) == "/dev/x y"
    assert process.wait(30.0)
    assert process.end(30.0) == 0
    assert lines == ["late 1", "late 2"]


def test_a_child_that_is_never_ready_is_killed():
    process = child(SLEEP)
    with pytest.raises(ChildError, match=r"the child did not start within 0\.2 s"):
        process.wait_ready(0.2)
    gone(process)


def test_a_child_that_dies_says_why():
    process = child("import sys; sys.exit('no such unit')")
    with pytest.raises(ChildError, match="the child did not start: no such unit"):
        process.wait_ready(30.0)
    gone(process)


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_a_talkative_child_does_not_stall(stream):
    """A pipe holds 64 kB."""
    noise = f"import sys\nfor _ in range(5000): print('x' * 99, file=sys.{stream})\n"
    process = child(f"{noise}print('ready', flush=True)\n{noise}", on_line=lambda line: None)
    assert process.wait_ready(30.0) == ""
    assert process.wait(30.0)
    assert process.end(30.0) == 0


def test_a_child_that_does_not_terminate_is_killed():
    process = child("import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('ready', flush=True);" + SLEEP)
    process.wait_ready(30.0)
    with pytest.raises(ChildError, match=r"did not stop within 0\.2 s and was killed"):
        process.end(0.2)
    gone(process)


def test_a_stopped_child_is_killed():
    process = child("print('ready', flush=True);" + SLEEP)
    process.wait_ready(30.0)
    os.kill(process.pid, signal.SIGSTOP)
    with pytest.raises(ChildError, match="did not answer within"):
        process.read_line(0.2)
    gone(process)


def test_a_child_that_ends_with_its_input_reads_the_last_words():
    process = child("import sys; print('ready', flush=True); sys.exit(len(sys.stdin.read()))")
    process.wait_ready(30.0)
    assert process.end(30.0, last_words="seven..") == 7
    with pytest.raises(ValueError, match="closed"):
        process.send("more")


def test_an_interrupted_wait_leaves_no_child():
    # The second is for this process, which on a busy machine may not be at its wait when the child begins.
    process = child(f"import os, signal, time; time.sleep(1.0); os.kill({os.getpid()}, signal.SIGINT);" + SLEEP)
    with pytest.raises(KeyboardInterrupt):
        process.wait_ready(30.0)
    gone(process)


FORKING = """
import os, sys, time
from aero.child_process import ChildProcess
reader = ChildProcess([sys.executable, "-c", "import sys; print('ready', flush=True); sys.stdin.read()"], "the reader")
reader.wait_ready(30.0)
forked = os.fork()
if not forked:
    time.sleep(600)
try:
    print("ready", reader.end(10.0, last_words=""), flush=True)
finally:
    os.kill(forked, 9)
"""


def test_a_process_that_is_forked_meanwhile_lets_go_of_the_child():
    """Else the child would wait for the end of its input as long as the fork lives."""
    process = child(FORKING)
    assert process.wait_ready(60.0) == "0"
    assert process.end(30.0, last_words="") == 0


def test_a_file_in_the_present_folder_takes_no_place_of_a_library(tmp_path, monkeypatch):
    """`python -m` puts the present folder first; the second process of a guarded hand ended with a traceback."""
    for name in ("signal", "serial", "selectors"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError('of the folder')")
    (tmp_path / "of_the_project.py").write_text("")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    done = subprocess.run(
        python("import signal, serial, selectors, of_the_project, aero.safety.__main__"), cwd=tmp_path,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
