import contextlib
import select
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
import serial
from hypothesis import example, given
from hypothesis import strategies as st

from aero_hil_terminal import Terminal
from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.kernel import Kernel
from firmware_emulator.links import pty
from firmware_emulator.links.in_process import InProcessLink
from firmware_emulator.links.pty import IDLE_S, POLLED_S, PtyServer

GET_TEMP = b"\x25".ljust(16, b"\0")


@contextlib.contextmanager
def served(server):
    stop = threading.Event()
    thread = threading.Thread(target=server.run, args=(stop.is_set,))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
        server.close()


def test_reading_moves_virtual_time_by_the_timeout_and_no_further_than_the_answer():
    hand = EmulatedHand(Bench())
    link = InProcessLink(hand)
    start = hand.clock.now()
    assert link.read(16, 0.5) == b""
    assert hand.clock.now() == start + 0.5
    link.write(GET_TEMP)
    assert len(link.read(16, 0.5)) == 16
    assert hand.clock.now() < start + 0.51


def test_an_answer_takes_the_time_from_host_to_firmware():
    link = InProcessLink(EmulatedHand(Bench(), host_latency_s=0.003))
    link.log = []
    link.write(GET_TEMP)
    assert len(link.read(16, 0.1)) == 16
    (asked, *_), (answered, *_) = link.log
    assert answered - asked == pytest.approx(0.003)


def test_a_short_read_leaves_the_rest_and_discarding_drops_it():
    link = InProcessLink(EmulatedHand(Bench()))
    link.write(GET_TEMP * 2)
    whole = link.read(10, 0.1) + link.read(6, 0.1)
    assert whole[:2] == GET_TEMP[:2]
    link.read(4, 0.1)
    link.discard_input()
    assert link.read(1, 0.1) == b""


def test_a_closed_link_says_so_and_keeps_what_the_board_sends_for_the_next_one():
    hand = EmulatedHand(Bench())
    link = InProcessLink(hand)
    link.write(GET_TEMP)
    link.close()
    link.close()
    for use in (lambda: link.write(b""), lambda: link.read(1, 0.0)):
        with pytest.raises(ConnectionError, match="closed"):
            use()
    hand.clock.sleep_until(hand.clock.now() + 0.1)
    assert len(InProcessLink(hand).read(99, 0.0)) == 16


def test_a_client_comes_back_to_the_terminal(tmp_path):
    path = tmp_path / "hand"
    server = PtyServer(EmulatedHand(Bench()), link=path)
    with served(server):
        assert path.is_symlink()
        for _ in range(2):
            with serial.Serial(server.name, 921600, timeout=1.0) as port:
                port.write(GET_TEMP)
                assert port.read(16)[:2] == GET_TEMP[:2]
    assert not path.is_symlink()


def test_answers_over_a_terminal_are_those_of_the_same_bytes_at_the_same_instants():
    server = PtyServer(EmulatedHand(Bench(), seed=7, firmware="0.1.0", start="reset"))
    heard: list = []
    server.listeners.append(heard.append)
    with served(server), serial.Serial(server.name, timeout=1.0) as port:
        port.read(241)
        for word in range(20):
            port.write(b"\x11\0" + bytes((0, word * 6)) * 7 + b"\x24".ljust(16, b"\0"))
            assert len(port.read(16)) == 16
    again = InProcessLink(EmulatedHand(Bench(), seed=7, firmware="0.1.0", start="reset"))
    again.log = []
    hand = again._electronics
    for t, direction, data in heard:
        if direction == ">":
            hand.clock.sleep_until(t)
            again.write(data)
    hand.clock.sleep_until(heard[-1][0])
    assert again.log == heard


def test_time_passes_at_the_rate_of_the_wall_clock():
    hand = EmulatedHand(Bench())
    server = PtyServer(hand)
    start, began = hand.clock.now(), time.monotonic()
    with served(server):
        Path(server.name).stat()
        while time.monotonic() < began + 0.3:
            threading.Event().wait(0.02)
    assert 0.1 < hand.clock.now() - start < time.monotonic() - began


TURN_S, WAKES_LATE_S = 7e-6, 70e-6


@given(st.floats(0.0, 3 * IDLE_S))
@example(POLLED_S)
@example(2 * POLLED_S)
@example(2 * IDLE_S)
def test_a_wait_as_short_as_for_an_answer_is_polled_and_a_longer_one_slept(due_s):
    """On a computer that spends 7 us on a turn and wakes a sleeper 70 us late."""
    kernel, now, waits, events = Kernel(), [0.0], [], []
    kernel.call_at(due_s, lambda: events.append(now[0]))

    def select_none(_ready, _writable, _failed, timeout):
        waits.append(timeout)
        now[0] += timeout + WAKES_LATE_S if timeout else TURN_S
        return [], [], []

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pty, "time", SimpleNamespace(monotonic=lambda: now[0]))
        patch.setattr(pty, "select", SimpleNamespace(select=select_none))
        pty.serve(kernel, (), lambda _end: None, lambda: bool(events))
    assert events[0] - due_s <= (TURN_S if due_s <= POLLED_S else WAKES_LATE_S) + 1e-9
    assert all(POLLED_S < wait <= IDLE_S for wait in waits if wait)
    assert not any(waits) or due_s > POLLED_S
    assert len(waits) <= POLLED_S / TURN_S + due_s / IDLE_S + 2


def test_servos_on_a_serial_port_answer_a_foreign_board():
    with Terminal() as board:
        server = PtyServer(EmulatedHand(Bench(), start="bare"), bus_port=board.path)
        with served(server):
            board.write(bytes.fromhex("FF FF 03 02 01 F9"))
            answer = b""
            deadline = time.monotonic() + 5.0
            while len(answer) < 6 and time.monotonic() < deadline:
                select.select([board], [], [], 0.1)
                answer += board.read()
    assert answer == bytes.fromhex("FF FF 03 02 00 FA")


def test_a_port_that_cannot_be_opened_leaves_no_link(tmp_path):
    link = tmp_path / "hand"
    with pytest.raises(serial.SerialException):
        PtyServer(EmulatedHand(Bench()), link=link, bus_port=str(tmp_path / "nothing"))
    assert not link.is_symlink()


def test_a_stale_link_is_replaced_and_a_live_one_is_not(tmp_path):
    stale, live = tmp_path / "stale", tmp_path / "live"
    stale.symlink_to("/dev/pts/999999")
    with Terminal(stale) as terminal:
        assert str(stale.readlink()) == terminal.path
        live.symlink_to(stale)
        with pytest.raises(FileExistsError, match="stop what serves it"):
            Terminal(live)
    assert live.is_symlink()
    assert not stale.is_symlink()


def test_bytes_for_a_client_that_never_reads_are_lost_without_blocking():
    with Terminal() as terminal:
        for _ in range(10000):
            terminal.write(bytes(16))
        assert terminal.read() == b""
