"""An emulated hand whose program is interrupted at any line goes on, or says that it cannot."""

import signal
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import firmware_emulator
from aero import AeroHand
from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.kernel import Kernel, KernelLeftError
from firmware_emulator.links.in_process import InProcessLink

EMULATOR = str(Path(firmware_emulator.__file__).parent)
LINES = 6_000
"""Lines of the emulator in one exchange and the wait after it; more are none."""


class Interrupting:
    """Does something at one line of the emulator, counted from the start of the block."""

    def __init__(self, line, act):
        self._left, self._act, self.done = line, act, False

    def __enter__(self):
        sys.settrace(self._trace)
        return self

    def __exit__(self, *_):
        sys.settrace(None)

    def _trace(self, frame, event, _argument):
        if not frame.f_code.co_filename.startswith(EMULATOR):
            return None
        if event == "line":
            self._left -= 1
            if not self._left:
                self.done = True
                self._act()
        return self._trace


def hand_on_bench():
    electronics = EmulatedHand(Bench())
    link = InProcessLink(electronics)
    return electronics, link, AeroHand(link, electronics.clock)


@pytest.fixture(scope="module")
def hand():
    """One hand for all interruptions, as in a notebook."""
    electronics, _link, hand = hand_on_bench()
    return hand, electronics.clock


def exchange(hand, clock):
    hand.command_codes([9000] * 7)
    hand.read_codes()
    clock.sleep_until(clock.now() + 0.02)


@settings(max_examples=100, deadline=None)
@given(line=st.integers(1, LINES), number=st.sampled_from([signal.SIGINT, signal.SIGALRM, signal.SIGTERM]))
def test_a_hand_answers_after_a_signal_at_any_line(hand, line, number):
    """Of 33 hands that were interrupted so, 22 answered nothing any more."""

    def leave(*_):
        raise TimeoutError

    before = signal.signal(number, leave)
    interrupted = Interrupting(line, lambda: signal.raise_signal(number))
    try:
        with interrupted:
            exchange(*hand)
        assert not interrupted.done
    except TimeoutError:
        assert interrupted.done
    finally:
        assert signal.signal(number, before) is leave
    driver, clock = hand
    driver.resynchronise()
    driver.command_codes([0] * 7)
    clock.sleep_until(clock.now() + 1.0)
    assert np.all(driver.read_codes() < 2000)


@settings(max_examples=50, deadline=None)
@given(line=st.integers(1, LINES))
def test_a_signal_that_does_not_raise_changes_no_byte(line):
    def session(line):
        electronics, link, hand = hand_on_bench()
        link.log = []
        with Interrupting(line, lambda: signal.raise_signal(signal.SIGALRM)):
            exchange(hand, electronics.clock)
        return link.log, electronics.kernel.now

    before = signal.signal(signal.SIGALRM, lambda *_: None)
    try:
        assert session(line) == session(0)
    finally:
        signal.signal(signal.SIGALRM, before)


@settings(max_examples=50, deadline=None)
@given(line=st.integers(1, LINES))
def test_an_exception_that_is_no_signal_is_noticed_by_the_next_use(line):
    """A debugger or another thread can raise at any line; nothing can hold that."""

    def leave():
        raise KeyboardInterrupt

    electronics, _link, hand = hand_on_bench()
    interrupted = Interrupting(line, leave)
    try:
        with interrupted:
            exchange(hand, electronics.clock)
    except KeyboardInterrupt:
        pass
    if electronics.kernel.left:
        with pytest.raises(KernelLeftError, match="open a new one"):
            exchange(hand, electronics.clock)
    else:
        hand.resynchronise()
        assert len(hand.read_codes()) == 7


def test_a_signal_too_many_leaves_an_event_that_hangs():
    kernel, before = Kernel(), signal.getsignal(signal.SIGINT)

    def hangs():
        while True:
            signal.raise_signal(signal.SIGINT)

    kernel.call_at(0.0, hangs)
    with pytest.raises(KeyboardInterrupt):
        kernel.run_until(1.0)
    assert kernel.left
    assert signal.getsignal(signal.SIGINT) is before


def test_a_long_wait_ends_at_the_signal():
    kernel, beats = Kernel(), []

    def task():
        while True:
            beats.append(kernel.now)
            if len(beats) == 5:
                signal.raise_signal(signal.SIGINT)
            yield kernel.now + 1.0

    kernel.spawn(task())
    with pytest.raises(KeyboardInterrupt):
        kernel.run_until(1e6)
    assert len(beats) == 5
    kernel.run_until(9.5)
    assert beats == list(range(10))


def test_a_kernel_of_another_thread_holds_nothing():
    kernel, seen, before = Kernel(), [], signal.getsignal(signal.SIGINT)
    kernel.call_at(0.0, lambda: seen.append(signal.getsignal(signal.SIGINT)))
    thread = threading.Thread(target=kernel.run_until, args=(1.0,))
    thread.start()
    thread.join()
    assert seen == [before]
