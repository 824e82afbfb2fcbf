"""What must run while a hand moves is asked whether it runs, not whether it was made.

An exception may come between the making of a thread or a process and its start: "can't start new thread", or Ctrl-C.
"""

import signal
import subprocess
import sys
import threading
from types import SimpleNamespace

import pytest

from aero.child_process import ChildProcess
from aero.firmware import firmware_of
from aero.safety import GuardedHand, Standby, Thresholds
from aero.safety.stop import Phase
from aero.safety.watchdog import Watchdog
from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink


@pytest.fixture
def once(monkeypatch):
    """Let no thread start the first time."""
    start, failed = threading.Thread.start, []

    def failing(thread):
        if not failed:
            failed.append(thread)
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", failing)
    return failed


@pytest.mark.usefixtures("once")
def test_a_watchdog_whose_thread_did_not_start_is_started_the_next_time():
    checked = threading.Event()
    watchdog = Watchdog(checked.set, 0.01)
    with pytest.raises(RuntimeError, match="new thread"):
        watchdog.start()
    watchdog.start()
    assert checked.wait(10.0)
    running = watchdog._thread
    watchdog.start()
    assert watchdog._thread is running
    watchdog.end()
    running.join()


@pytest.mark.usefixtures("once")
def test_a_hand_whose_watchdog_did_not_start_is_not_moved_and_is_watched_the_next_time():
    electronics = EmulatedHand(Bench())
    hand = GuardedHand(
        InProcessLink(electronics), electronics.clock, spans_counts=[3278] * 7, usual=firmware_of("0.2.0").settings
    )
    hand._guard._standby = SimpleNamespace(start=lambda: None, stand_down=lambda: None)
    with pytest.raises(RuntimeError, match="new thread"):
        hand.command_codes([0x7000] * 7)
    assert hand.phase is Phase.RESTING
    hand.command_codes([0x7000] * 7)
    watching = hand._guard._watchdog._thread
    assert watching.is_alive()
    hand.close()
    watching.join()


@pytest.mark.usefixtures("once")
def test_a_child_whose_output_nobody_could_read_is_ended(monkeypatch):
    started, popen = [], subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **how: started.append(popen(*a, **how)) or started[-1])
    with pytest.raises(RuntimeError, match="new thread"):
        ChildProcess([sys.executable, "-c", "import time; time.sleep(600)"], "the child")
    assert started[0].returncode == -signal.SIGKILL


def test_a_second_process_that_ctrl_c_left_unready_is_made_anew(monkeypatch):
    """The signal came when the process was made, and was delivered before the wait for it had begun."""
    second, started, popen = Standby("/dev/no-such-hand", Thresholds(), settable=True), [], subprocess.Popen

    def interrupted(*arguments, **how):
        started.append(popen(*arguments, **how))
        signal.raise_signal(signal.SIGINT)
        return started[-1]

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with monkeypatch.context() as at_first:
            at_first.setattr(subprocess, "Popen", interrupted)
            with pytest.raises(KeyboardInterrupt):
                second.start()
    finally:
        signal.signal(signal.SIGINT, before)
    assert started[0].returncode is not None, "it was ended"
    second.start()
    assert second._process.pid != started[0].pid
    second.stand_down()
