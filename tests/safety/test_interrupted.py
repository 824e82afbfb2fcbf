"""Ctrl-C at any line of a guarded hand: it starts gently again, and it is left open and weak."""

import gc
import signal
import sys
import threading
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
from nightly import NIGHTLY

import aero
from aero import AeroHand, Channel
from aero.errors import AeroError
from aero.firmware import firmware_of
from aero.protocol import MAX_CODE, Opcode, parse_reply, unsigned_values
from aero.safety import GuardedHand, SafetyReason, SafetyStopError, Thresholds
from aero.safety.opening import open_and_relax
from aero.safety.stop import Phase
from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink

TRACED = tuple(str(Path(aero.__file__).parent / part) for part in ("safety", "link.py", "driver.py"))
FIST = [0x7000] * 7
LEAP = 2 * MAX_CODE * 0.02 / Thresholds().opening_s
"""Twice the step from one command of a slow start to the next, codes: its first one is from where the hand stands."""


class Logged(InProcessLink):
    """Takes down what the driver writes."""

    def __init__(self, electronics):
        super().__init__(electronics)
        self.sent = []

    def write(self, data):
        self.sent.append(bytes(data))
        super().write(data)

    @property
    def positions(self):
        """Every position command, (n, 7) codes."""
        return np.array([unsigned_values(parse_reply(d)) for d in self.sent if d[:1] == bytes((Opcode.CTRL_POS,))], int)


def new_hand(firmware="0.2.0"):
    electronics = EmulatedHand(Bench(), firmware=firmware)
    link = Logged(electronics)
    hand = GuardedHand(
        link, electronics.clock, spans_counts=[3278] * 7, usual=firmware_of(firmware).settings, standby=None
    )
    return electronics, link, hand


def ctrl_c():
    raise KeyboardInterrupt


@contextmanager
def interrupting(number, interrupt=ctrl_c):
    """Interrupt a line of the driver or its guard: the first time that the `number`-th different one is reached."""
    seen, state = set(), {"at": ""}

    def trace(frame, event, _argument):
        if not frame.f_code.co_filename.startswith(TRACED):
            return None
        where = frame.f_code.co_filename, frame.f_lineno
        if event == "line" and not state["at"] and where not in seen:
            seen.add(where)
            if len(seen) == number:
                state["at"] = f"{where[0]}:{where[1]}"
                interrupt()
        return trace

    sys.settrace(trace)
    try:
        yield state
    finally:
        sys.settrace(None)


def assert_open_and_weak(electronics):
    electronics.clock.sleep_until(electronics.clock.now() + 0.5)
    codes = AeroHand(InProcessLink(electronics), electronics.clock).read_codes()
    assert codes.max() < Thresholds().arrival * MAX_CODE
    assert [servo.memory.get("goal_torque") for servo in electronics.servos] == [Thresholds().limp_torque] * 7


EVERY, LAST = 60, 420
"""The default suite interrupts one line in so many; beyond the last there is none."""
STEP = 1 if NIGHTLY else 4
"""The slow tests interrupt one line in so many."""
FEWEST = 200
"""Lines of the driver and its guard that a start and a program have at least, or they are not seen."""
at_each_line = pytest.mark.parametrize(
    "numbers",
    [(number,) for number in range(1, LAST, EVERY)]
    + [pytest.param(range(n + 1, n + EVERY, STEP), marks=pytest.mark.slow) for n in range(1, LAST, EVERY)],
    ids=lambda numbers: f"{numbers[0]}-{numbers[-1]}",
)


def test_ctrl_c_in_a_long_homing_waits_until_the_board_answers():
    electronics, link, hand = new_hand()
    write = link.write

    def interrupted(data):
        write(data)
        if bytes(data)[:1] == bytes((Opcode.HOMING,)):
            link.write = write
            raise KeyboardInterrupt

    link.write = interrupted
    with hand, pytest.raises(KeyboardInterrupt):
        hand.home()
    assert_open_and_weak(electronics)


@at_each_line
def test_a_slow_start_that_is_interrupted_is_made_again(numbers):
    for number in numbers:
        electronics, link, hand = new_hand()
        try:
            with suppress(KeyboardInterrupt), interrupting(number) as state:
                hand.command_codes(FIST)
            if not state["at"]:
                assert number > FEWEST
                return
            with suppress(AeroError):
                hand.resynchronise()
            begin = len(link.positions)
            hand.command_codes(FIST)
            started = link.positions[max(0, begin - 1) :]
            assert np.abs(np.diff(started, axis=0)).max() < LEAP, state
            assert hand.phase is Phase.MOVING
            usual = firmware_of("0.2.0").settings
            hand.command_codes(FIST)  # the board applies limits with the next command
            assert hand.settings_sent[Opcode.SET_SPE, Channel.INDEX] == usual.speed, state
            assert hand.settings_sent[Opcode.SET_TOR, Channel.INDEX] == usual.torque, state
            assert hand.settings_sent[Opcode.SET_TOR, Channel.THUMB_FLEXOR] == Thresholds().stop_torque, state
        finally:
            hand.close()
        assert_open_and_weak(electronics)


@pytest.fixture
def ctrl_c_raises():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@at_each_line
def test_a_program_that_is_interrupted_leaves_the_hand_open_and_weak(numbers, ctrl_c_raises):
    """By Ctrl-C, which the end of the program holds back, at any line of it: the first motion, a wait, the ending."""
    for number in numbers:
        electronics, _link, hand = new_hand()
        hand.command_codes(FIST)
        with (
            suppress(KeyboardInterrupt),
            interrupting(number, lambda: signal.raise_signal(signal.SIGINT)) as state,
            hand,
        ):
            hand.set_torque(Channel.INDEX, 300)
            hand.command_codes(FIST)
            hand.clock.sleep_until(hand.clock.now() + 0.2)
        del hand  # Ctrl-C may have come before the `with` statement could close it
        gc.collect()
        if not state["at"]:
            assert number > FEWEST
            return
        assert_open_and_weak(electronics)


def test_every_call_is_refused_while_the_hand_is_opened_for_the_last_time(monkeypatch):
    """From another thread, which would fight the opening, and from a signal handler of the same one."""
    electronics, link, hand = new_hand()
    hand.command_codes(FIST)
    refused = []

    def command():
        try:
            hand.command_codes(FIST)
        except SafetyStopError as error:
            refused.append(error.reason)

    opening = open_and_relax

    def watched(*arguments, **how):
        thread = threading.Thread(target=command)
        thread.start()
        thread.join(5.0)
        assert not thread.is_alive(), "the call waits for the opening instead of being refused"
        command()
        return opening(*arguments, **how)

    monkeypatch.setattr("aero.safety.guard.open_and_relax", watched)
    begin = len(link.positions)
    hand.close()
    assert refused == [SafetyReason.ENDED] * 2
    assert np.diff(link.positions[begin - 1 :], axis=0).max() <= 0, "nothing closes the hand again"
    assert_open_and_weak(electronics)
