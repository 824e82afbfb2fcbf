"""A child that is silent, stopped, talkative or dead costs its parent a limited time, and is gone afterwards."""

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from threading import Event
from time import process_time

import pytest

from aero.child_process import LONGEST_LINE, ChildError, ChildProcess, ChildTimeoutError, python

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


GRANDCHILD = "import subprocess, sys; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])\n"


def empty(group):
    """Return whether the processes of a group are gone within 5 s, or wait for process 1 alone."""
    for _ in range(500):
        stats = []
        for path in Path("/proc").glob("[0-9]*/stat"):
            with suppress(OSError):
                stats.append(path.read_text().rpartition(")")[2].split())
        if not any(int(its_group) == group and state != "Z" for state, _parent, its_group, *_ in stats):
            return True
        Event().wait(0.01)
    return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
@pytest.mark.parametrize("kills", [True, False])
def test_a_dead_child_is_noticed_at_once_though_its_own_child_holds_the_pipes(kills):
    process = child(f"{GRANDCHILD}print('ready', flush=True); sys.stdin.readline(); sys.exit('gone')")
    process.wait_ready(30.0)
    process.send("\n")
    with pytest.raises(ChildError, match="did not answer: gone") as caught:
        process.read_line(600.0, kills=kills)
    assert not isinstance(caught.value, ChildTimeoutError)
    assert empty(process.pid)
    process.kill()


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
def test_an_ended_child_leaves_no_child_of_its_own():
    process = child(f"{GRANDCHILD}print('ready', flush=True); sys.stdin.read()")
    process.wait_ready(30.0)
    assert process.end(30.0, last_words="") == 0
    assert empty(process.pid)


COPIED = """
import os, sys
from aero.child_process import ChildProcess
process = ChildProcess([sys.executable, "-c", "import sys; print('ready', flush=True); sys.stdin.read()"], "the child")
process.wait_ready(30.0)
copy = os.fork()
if not copy:
    process.end(0.0)
    process.kill()
    os._exit(0)
status = os.waitpid(copy, 0)[1]
print("ready", status, process.running, process.end(10.0, last_words=""), flush=True)
"""


def test_a_forked_copy_ends_nothing():
    """In a process of its own: to fork this one, with the threads of a library that another test loaded, may hang."""
    process = child(COPIED)
    assert process.wait_ready(60.0) == "0 True 0"
    assert process.end(30.0, last_words="") == 0


def cost_of(stream, line):
    """Return the CPU time of receiving 10 MB on a stream, s, and the lengths of the lines that were delivered."""
    lengths, before = [], process_time()
    program = f"import sys; sys.{stream}.write(({line}) * (10_000_000 // len({line})))"
    process = child(
        program, **{{"stdout": "on_line", "stderr": "on_error"}[stream]: lambda text: lengths.append(len(text))}
    )
    assert process.wait(60.0)
    process.kill()
    return process_time() - before, lengths


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_a_long_line_comes_in_parts_and_costs_no_more_than_many_short_ones(stream):
    short_s, _ = cost_of(stream, "'x' * 99 + '\\n'")
    long_s, lengths = cost_of(stream, "'x'")
    assert sum(lengths) == 10_000_000
    assert max(lengths) < 2 * LONGEST_LINE
    assert long_s < 5 * short_s
