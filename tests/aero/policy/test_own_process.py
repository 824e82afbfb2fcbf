"""The process of a policy: what it starts, opens and writes disturbs no run, and ends with it in order."""

from contextlib import suppress
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from own_policies import write_factory, write_interface

from aero.policy import own
from aero.policy.interface import PolicyFileError
from aero.policy.shipped import find_policy

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")

CHILDREN = {
    "fork": "if os.fork() == 0: signal.pause()",
    "fork that goes on": "os.fork()",
    "multiprocessing": "multiprocessing.get_context('fork').Process(target=signal.pause).start()",
    "pool": "kept.append(multiprocessing.get_context('fork').Pool(2))",
    "program": "kept.append(subprocess.Popen([sys.executable, '-c', 'import signal; signal.pause()']))",
    "thread": "threading.Thread(target=signal.sigwait, args=([signal.SIGUSR1],)).start()",
}
"""Lines of a step that start something."""
WAITED_FOR = {"multiprocessing", "thread"}
"""What Python itself waits for at its end, without a limit."""
SOURCE = """
import atexit, multiprocessing, os, pathlib, signal, subprocess, sys, threading
from contextlib import suppress
seen, kept, log = [], [], open("log.txt", "w")
atexit.register(pathlib.Path("left.txt").write_text, "left")

def say(text):
    for descriptor in range(3, 20):
        with suppress(OSError):
            os.write(descriptor, text.encode())

def act(observation):
    seen.append(1)
    log.write("x")
    if len(seen) == 2:
        {}
    return [float(len(seen))] * 7

make = lambda: act
"""
ZEROS = np.zeros(14)


@pytest.fixture
def busy(tmp_path, monkeypatch):
    """Return a function that loads a policy with extra lines in its second step; loading does the first."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(own, "EXIT_S", 1.0)
    monkeypatch.setattr(own, "STEP_S", 0.3)

    def load(*lines):
        name = write_factory(tmp_path)
        (tmp_path / "my_policy.py").write_text(SOURCE.format("\n        ".join(lines)))
        return find_policy(name).network

    return load


def left(network):
    """Return the states of the processes in a policy's group; a killed one has 5 s to go."""
    for _ in range(500):
        stats = []
        for path in Path("/proc").glob("[0-9]*/stat"):
            with suppress(OSError):
                stats.append(path.read_text().rpartition(")")[2].split())
        found = [state for state, _parent, group, *_ in stats if int(group) == network._process.pid and state != "Z"]
        if not found:
            break
        Event().wait(0.01)
    return found


def files(folder):
    return [(folder / name).read_text() if (folder / name).exists() else "" for name in ("log.txt", "left.txt")]


@pytest.mark.parametrize("kind", CHILDREN)
def test_a_policy_exits_in_order_and_leaves_no_process(busy, tmp_path, capfd, kind):
    network = busy(CHILDREN[kind])
    network._patience_s = 30.0
    assert [network.act(ZEROS)[0] for _ in range(3)] == [2.0, 3.0, 4.0]
    network.end()
    assert left(network) == []
    assert ("was killed" in capfd.readouterr().err) == (kind in WAITED_FOR)
    if kind not in WAITED_FOR:
        assert files(tmp_path) == ["xxxx", "left"]


@pytest.mark.parametrize("kind", ["fork", "pool", "program"])
def test_a_policy_that_dies_is_noticed_at_once_whatever_it_has_started(busy, monkeypatch, kind):
    network = busy(CHILDREN[kind], "os.kill(os.getpid(), signal.SIGKILL)")
    network._patience_s = 600.0
    for _ in range(2):
        with pytest.raises(PolicyFileError, match="its process has ended"):
            network.act(ZEROS)
    assert left(network) == []


@pytest.mark.parametrize("line", ["raise ValueError('no')", "while True: signal.pause()", "exit(3)"])
def test_a_step_that_fails_or_hangs_loses_no_file(busy, tmp_path, line):
    network = busy(line)
    with pytest.raises(PolicyFileError):
        network.act(ZEROS)
    network.end()
    assert files(tmp_path) == ["xx", "left"]


@pytest.mark.parametrize("text", ["hello", "{", "5", "[" * 9000, '{"question": 2}', '{"shape": [7], "action": [1.0]}'])
def test_bytes_on_the_descriptor_of_the_answers_are_one_line(busy, text):
    network = busy(f"say({text!r})")
    with pytest.raises(PolicyFileError, match="descriptor of its answers") as caught:
        network.act(ZEROS)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 200


def test_an_answer_too_many_shifts_no_action(busy):
    network = busy("""say('{"question": 1, "shape": [7], "action": [9, 9, 9, 9, 9, 9, 9]}\\n' * 3)""")
    network._patience_s = 30.0
    assert [network.act(ZEROS)[0] for _ in range(3)] == [2.0, 3.0, 4.0]


def test_a_policy_that_closes_every_descriptor_is_one_line(busy):
    network = busy("os.closerange(3, 100)")
    with pytest.raises(PolicyFileError, match="did not answer"):
        network.act(ZEROS)


@pytest.mark.parametrize("name", ["test", "test.inner", "pydoc_data"])
def test_a_module_of_the_folder_precedes_one_of_the_library(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    folder, _, file = name.rpartition(".")
    path = tmp_path / folder / f"{file}.py"
    path.parent.mkdir(exist_ok=True)
    (path.parent / "__init__.py").touch()
    path.write_text("OWN = 1\nmake = lambda: lambda observation: [0.0 * OWN] * 7")
    write_interface(path.with_suffix(".toml"))
    assert find_policy(f"{name}:make").name == f"{name}:make"


@pytest.mark.parametrize(
    ("name", "factory"),
    [("my_policy.py", "my_policy:make"), ("a/b.py", "a.b:make"), ("my_policy.py:make", "my_policy:make")],
)
def test_a_path_of_python_source_is_answered_with_the_name_of_a_factory(tmp_path, monkeypatch, name, factory):
    monkeypatch.chdir(tmp_path)
    write_factory(tmp_path)
    with pytest.raises(PolicyFileError, match=f"name a factory in it as {factory}"):
        find_policy(name)
