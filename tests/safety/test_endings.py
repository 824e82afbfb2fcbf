"""How programs end that do not end by themselves: signals, being killed, and a port that another one holds."""

import array
import fcntl
import os
import shutil
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from aero import open_hand, serial_transport
from aero.safety import GuardedHand, SafetyReason, SafetyStopError, Standby, Thresholds, standby
from aero.safety.interrupts import uninterrupted, unwinding
from aero.serial_transport import SerialTransport
from aero_hil_terminal import Terminal
from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from firmware_emulator.links.pty import PtyServer
from hil import NoHandError
from hil.emulated.any_hand import open_target

ROOT = Path(__file__).parents[2]
TIOCGEXCL = 0x80045440
"""Asks Linux whether a terminal refuses further openings; Python's termios does not name it."""

PROGRAM = """
import os, sys
from aero import open_hand
from aero.safety import Thresholds

path, limits = sys.argv[1], Thresholds(opening_s=0.3, stale_s=5.0, silent_s=5.0)
with open_hand(path, firmware="0.2.0", thresholds=limits) as hand:
    if "fork" in sys.argv and not os.fork():
        os.read(0, 1)  # a worker, started before the first motion; it lives as long as the test
        os._exit(0)
    hand.command_codes([40000] * 7)
    if "fork" in sys.argv and not os.fork():
        os.read(0, 1)  # another one, which holds copies of all that is open now
        os._exit(0)
    print("closing", flush=True)
    hand.clock.sleep_until(hand.clock.now() + 60)
"""
"""A guarded program that closes the hand and then waits for a minute; a busy machine may keep it from looking."""


class Onlooker:
    """Sees a bench hand close and open again, from the thread that serves it."""

    def __init__(self, electronics):
        self._electronics = electronics
        self.closed, self.opened, self.leave = threading.Event(), threading.Event(), threading.Event()

    def look(self):
        """Return whether to stop serving."""
        self._electronics.advance_plant()
        index = np.rad2deg(self._electronics.chain.shafts.sample().angles[0])
        if index > 160.0:
            self.closed.set()
        elif index < 10.0 and self.closed.is_set():
            self.opened.set()
        return self.leave.is_set()


def closed_and_then(number, *arguments, program=PROGRAM, cwd=ROOT):
    """Let a program close a hand on a pseudo-terminal, send it a signal, and wait until the hand has opened."""
    electronics = EmulatedHand(Bench())
    server, onlooker = PtyServer(electronics), Onlooker(electronics)
    thread = threading.Thread(target=server.run, args=(onlooker.look,))
    thread.start()
    command = [sys.executable, "-c", program, server.name, *arguments]
    # A session of its own, so that workers that it leaves behind can be ended with it.
    child = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,  # its end tells the workers to go
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,  # its end tells that the second process, which writes there too, has left
        text=True,
        cwd=cwd,
        start_new_session=True,
    )
    try:
        assert child.stdout.readline() == "closing\n"
        assert onlooker.closed.wait(10.0)
        child.send_signal(number)
        child.wait(timeout=20)
        assert onlooker.opened.wait(10.0)
        return child.returncode
    finally:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)
        # A second process that has not left waits for its port, and takes the next terminal of that name for it.
        child.communicate()
        onlooker.leave.set()
        thread.join()
        server.close()


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGTERM,
        signal.SIGKILL,
        pytest.param(signal.SIGINT, marks=pytest.mark.slow),
        pytest.param(signal.SIGHUP, marks=pytest.mark.slow),
    ],
)
def test_a_program_that_is_stopped_or_killed_leaves_the_hand_open(number):
    codes = {signal.SIGINT: -signal.SIGINT, signal.SIGTERM: 143, signal.SIGHUP: 129, signal.SIGKILL: -signal.SIGKILL}
    assert closed_and_then(number) == codes[number]


def test_a_program_that_blocks_does_not_hold_the_hand_closed():
    """As in a callback that takes half a minute; the hand is opened meanwhile, and the next call says why."""
    electronics = EmulatedHand(Bench())
    server, onlooker = PtyServer(electronics), Onlooker(electronics)
    thread = threading.Thread(target=server.run, args=(onlooker.look,))
    thread.start()
    limits = Thresholds(opening_s=0.3, stale_s=5.0, silent_s=5.0, unwatched_s=1.0)
    try:
        with open_hand(server.name, firmware="0.2.0", thresholds=limits) as hand:
            hand.command_codes([40000] * 7)
            assert onlooker.closed.wait(10.0)
            assert onlooker.opened.wait(20.0)  # no call of the hand meanwhile
            with pytest.raises(SafetyStopError, match="nobody has polled the hand") as stop:
                hand.read_codes()
        assert stop.value.reason is SafetyReason.UNWATCHED
    finally:
        onlooker.leave.set()
        thread.join()
        server.close()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_killed_program_that_has_forked_workers_leaves_the_hand_open():
    """They hold neither the pipe to the second process nor the port."""
    assert closed_and_then(signal.SIGKILL, "fork") == -signal.SIGKILL


def test_a_killed_program_that_is_not_installed_leaves_the_hand_open(tmp_path, monkeypatch):
    """It finds `aero` through its own search path, and runs in a folder where nothing else would."""
    monkeypatch.delenv("PYTHONPATH", raising=False)
    program = f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{PROGRAM}"
    assert closed_and_then(signal.SIGKILL, program=program, cwd=tmp_path) == -signal.SIGKILL


def test_a_hand_whose_second_process_does_not_start_is_not_moved(monkeypatch):
    monkeypatch.setattr(standby, "_RUN", "raise SystemExit('no such port')")
    with pytest.raises(SafetyStopError, match=r"not moved. The second process"):
        Standby("/dev/no-such-hand", Thresholds(), settable=True).start()


@pytest.mark.usefixtures("_ctrl_c_raises")
def test_ctrl_c_while_the_second_process_starts_ends_it_and_the_next_start_begins_anew(monkeypatch):
    """A program left 30 s later, and a second one was started over the first."""
    run = standby._RUN
    second = Standby("/dev/no-such-hand", Thresholds(), settable=True)
    with monkeypatch.context() as slow:
        slow.setattr(standby, "_RUN", "import time; time.sleep(60)")
        interrupt = threading.Timer(0.3, signal.pthread_kill, [threading.main_thread().ident, signal.SIGINT])
        started, popen = [], subprocess.Popen

        def start(*arguments, **how):
            started.append(popen(*arguments, **how))
            interrupt.start()
            return started[-1]

        slow.setattr(subprocess, "Popen", start)
        with pytest.raises(KeyboardInterrupt):
            second.start()
        interrupt.join()
    assert started[0].returncode is not None, "it was ended"
    monkeypatch.setattr(standby, "_RUN", run)
    second.start()
    first = second._process
    second.start()
    assert second._process is first
    second.stand_down()
    assert first._process.returncode == 0


def test_a_second_process_whose_program_was_killed_at_its_start_says_nothing():
    """Nothing has moved then, and nobody reads what it says."""
    read, write = os.pipe()
    os.close(read)
    port, settings = Standby("/dev/no-such-hand", Thresholds(), settable=True)._arguments
    ran = subprocess.run(
        [sys.executable, "-m", "aero.safety", port, settings],
        stdin=subprocess.DEVNULL, stdout=write, stderr=subprocess.PIPE, check=False, cwd=ROOT,
    )  # fmt: skip
    os.close(write)
    assert ran.returncode == 0
    assert ran.stderr == b""


def test_a_forked_process_may_not_use_the_hand():
    electronics = EmulatedHand(Bench())
    hand = GuardedHand(InProcessLink(electronics), electronics.clock, spans_counts=[3278] * 7, usual=None)
    hand._guard._owner += 1  # as in a child, where the process has another number
    with pytest.raises(SafetyStopError, match="forked"):
        hand.read_codes()
    hand.close()
    hand._guard._owner -= 1
    hand.read_codes()


@pytest.fixture
def _ctrl_c_raises():
    """As in a program that a terminal started, whatever ran in this process before."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_signals_wait_for_the_end_of_an_opening():
    log = []
    before = signal.signal(signal.SIGTERM, lambda *_: log.append("signal"))
    try:
        with uninterrupted():
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGTERM)
            log.append("opened")
    finally:
        signal.signal(signal.SIGTERM, before)
    assert log == ["opened", "signal"]


@pytest.mark.usefixtures("_ctrl_c_raises")
@pytest.mark.parametrize(
    ("doubt", "ending", "after"),
    [(None, KeyboardInterrupt, "stand_down"), ("a finger is closed", SafetyStopError, "take_over")],
)
def test_ctrl_c_during_the_last_opening_hides_no_hand_that_may_be_closed(monkeypatch, doubt, ending, after):
    """The signal comes after the opening, unless the hand may be closed: then that is said instead."""

    def opening(*_hand, **_how):
        signal.raise_signal(signal.SIGINT)
        return doubt

    asked = []
    electronics = EmulatedHand(Bench())
    hand = GuardedHand(InProcessLink(electronics), electronics.clock, spans_counts=[3278] * 7, usual=None)
    hand.command_codes([0] * 7)
    hand._guard._standby = SimpleNamespace(
        stand_down=lambda: asked.append("stand_down"), take_over=lambda: asked.append("take_over")
    )
    monkeypatch.setattr("aero.safety.guard.open_and_relax", opening)
    with pytest.raises(ending, match="SWITCH THE HAND'S SUPPLY OFF" if doubt else None):
        hand.close()
    assert asked == [after]


@pytest.fixture
def delivered():
    """Take down SIGTERM and SIGHUP."""
    numbers, log = (signal.SIGTERM, signal.SIGHUP), []
    before = [signal.signal(number, lambda number, _frame: log.append(number)) for number in numbers]
    yield log
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)


def test_signals_that_were_held_back_are_delivered_when_the_block_raises(delivered):
    """As when the disk is full that a recording is written to."""

    def write():
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGHUP)
        raise OSError("full")

    with pytest.raises(OSError, match="full"), uninterrupted():
        write()
    assert delivered == [signal.SIGTERM, signal.SIGHUP]


@pytest.mark.usefixtures("_ctrl_c_raises")
def test_every_signal_is_delivered_though_the_first_one_raises(delivered):
    def both():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt), uninterrupted():
        both()
    assert delivered == [signal.SIGTERM]


@pytest.mark.usefixtures("delivered")
def test_a_handler_that_the_block_installs_stays():
    def mine(*_):
        pass

    with uninterrupted(), unwinding():
        signal.signal(signal.SIGTERM, mine)
    assert signal.getsignal(signal.SIGTERM) is mine


@pytest.mark.usefixtures("_ctrl_c_raises")
def test_a_handler_that_python_did_not_install_is_left_alone(monkeypatch):
    """`getsignal` knows it as None, and `signal` could not put it back."""
    known = signal.getsignal
    monkeypatch.setattr(signal, "getsignal", lambda number: None if number == signal.SIGINT else known(number))
    with pytest.raises(KeyboardInterrupt), uninterrupted():
        signal.raise_signal(signal.SIGINT)


def test_termination_unwinds_and_the_old_handler_comes_back():
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(SystemExit) as caught, unwinding():
        signal.raise_signal(signal.SIGTERM)
    assert caught.value.code == 143
    assert signal.getsignal(signal.SIGTERM) == before


def test_a_signal_that_the_program_was_told_to_ignore_stays_ignored():
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with unwinding():
            signal.raise_signal(signal.SIGTERM)
            with uninterrupted():
                signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)


def test_threads_other_than_the_main_one_have_no_signals_to_hold_back():
    ran = []

    def opening():
        with uninterrupted(), unwinding():
            ran.append(True)

    thread = threading.Thread(target=opening)
    thread.start()
    thread.join()
    assert ran == [True]


def test_a_second_program_is_told_that_the_port_is_taken():
    terminal = Terminal()
    first = SerialTransport.open(terminal.path)
    with (
        pytest.raises(NoHandError, match=r"another program holds the port; close it first"),
        open_target(terminal.path),
    ):
        pytest.fail("the port is taken")
    first.close()
    terminal.close()


def test_a_port_is_closed_to_programs_that_do_not_lock_it(monkeypatch):
    """Shown on a pseudo-terminal that passes for a real one."""
    monkeypatch.setattr(serial_transport, "_is_pseudo_terminal", lambda port: False)

    def refuses_others():
        flag = array.array("i", [0])
        fcntl.ioctl(terminal._client, TIOCGEXCL, flag)
        return bool(flag[0])

    with Terminal() as terminal:
        transport = SerialTransport.open(terminal.path)
        assert refuses_others()
        transport.close()
        assert not refuses_others()


UNSHARE = ["unshare", "--user", "--map-root-user", "--pid", "--fork", "--mount-proc", "--kill-child"]
DIES = """
import os, sys
sys.path.insert(0, os.getcwd())
from aero import open_hand
from aero.safety import Thresholds

with open_hand(sys.argv[1], firmware="0.2.0", thresholds=Thresholds(stale_s=5.0, silent_s=5.0)) as hand:
    hand.command_codes([40000] * 7)
    hand.clock.sleep_until(hand.clock.now() + 1.0)
    os._exit(9)
"""
INIT = """
import subprocess, sys
sys.exit(subprocess.run(sys.argv[1:]).returncode)
"""
"""Process 1 as `docker run --init` has it: it ends when its child has ended."""


def can_unshare():
    return (
        shutil.which("unshare") and not subprocess.run([*UNSHARE, "true"], capture_output=True, check=False).returncode
    )


@pytest.mark.slow
@pytest.mark.skipif(not can_unshare(), reason="needs PID namespaces")
@pytest.mark.parametrize(
    ("around", "opened"),
    [
        ([], False),
        ([sys.executable, "-c", INIT], False),
        (["sh", "-c", '"$@"; sleep 90', "sh"], True),
    ],
)
def test_a_hand_of_a_program_that_dies_is_opened_where_process_1_lives_on(around, opened):
    electronics = EmulatedHand(Bench())
    server, onlooker = PtyServer(electronics), Onlooker(electronics)
    thread = threading.Thread(target=server.run, args=(onlooker.look,))
    thread.start()
    command = [*UNSHARE, *around, sys.executable, "-c", DIES, server.name]
    child = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    try:
        assert onlooker.closed.wait(30.0)
        assert onlooker.opened.wait(30.0 if opened else 8.0) == opened
    finally:
        child.kill()
        _, said = child.communicate()
        onlooker.leave.set()
        thread.join()
        server.close()
    assert "of its container" in said


@pytest.mark.parametrize(
    ("own", "parent", "first", "warns"),
    [
        (1, 0, "python", True),
        (7, 1, "docker-init", True),
        (7, 1, "systemd", False),
        (7, 3, "docker-init", False),
        (7, 0, "sleep", False),
    ],
)
def test_a_program_near_process_1_of_a_container_is_told(monkeypatch, own, parent, first, warns):
    monkeypatch.setattr("os.getpid", lambda: own)
    monkeypatch.setattr("os.getppid", lambda: parent)
    monkeypatch.setattr(Path, "read_text", lambda *_, **__: f"{first}\n")
    assert (standby.ends_with_process_1() is not None) == warns
