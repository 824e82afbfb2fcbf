"""A board executes nothing that its program has not asked for, whatever a link does and whatever the program ignores.

The counts of docs/internals/driver.md, 100 000 exchanges a schedule: `UNASKED_EXCHANGES=100000 pytest -s
tests/aero/test_link_out_of_step.py -k schedule`.
"""

import itertools
import logging
import os
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero import AeroHand, Channel
from aero.errors import AeroError, DesyncError, LinkTimeoutError
from aero.link_state import AFTER, MAY_LEAVE, Content, LinkEvent, State
from aero.protocol import make_harmless_positions, make_query

EXCHANGES = int(os.environ.get("UNASKED_EXCHANGES", "1500"))
KNOWN = {0x01, 0x02, 0x03, 0x11, 0x12, 0x22, 0x23, 0x24, 0x25, 0x31, 0x32}
"""All opcodes of docs/internals/driver.md, `aero-open-firmware` d7bd82e."""
GETS = {0x22, 0x23, 0x24, 0x25}
CTRL_POS = 0x11


class Faulty:
    """Schedules of faults between a driver and a board: what happens to each whole write."""

    def __init__(self, board, fault, share=0.1, seed=0):
        self.board, self.clock, self.name = board, board.clock, board.name
        self._fault, self._share, self._random = fault, share, np.random.default_rng(seed)
        self._until = 0.0
        self.asked = []

    def write(self, data):
        getattr(self, f"_{self._fault}")(bytes(data))

    def _stall(self, data):
        """Whole writes are swallowed for a while."""
        if self.clock.now() >= self._until and self._random.random() < self._share:
            self._until = self.clock.now() + self._random.uniform(0.0, 1.5)
        if self.clock.now() >= self._until:
            self.board.write(data)

    def _swallow(self, data):
        """One whole write is swallowed."""
        if self._random.random() >= self._share:
            self.board.write(data)

    def _reboot(self, data):
        """The board restarts: what it had not executed is gone, and it hears nothing for a while."""
        if self.clock.now() >= self._until and self._random.random() < self._share:
            self._until = self.clock.now() + self._random.uniform(0.1, 1.5)
            self.board.queue.clear()
            self.board.on_the_way.clear()
            self.board.say(0.05, b"ESP-ROM:esp32s3-20210327\r\n[BOOT] Hand Type: RIGHT_HAND\r\n")
        if self.clock.now() >= self._until:
            self.board.write(data)

    def _split(self, data):
        """A write comes in two pieces, of which the second one waits for the next write."""
        if len(data) > 1 and self._random.random() < self._share:
            at = self._random.integers(1, len(data))
            self.board.write(data[:at])
            self.clock.sleep_until(self.clock.now() + self._random.uniform(0.0, 0.3))
            data = data[at:]
        self.board.write(data)

    def read(self, size, timeout):
        return self.board.read(size, timeout)

    def close(self):
        self.board.close()

    def discard_input(self):
        self.board.discard_input()


def unasked(board, asked):
    """Return what the board executed beyond queries and what was asked, in its order."""
    left = iter(asked)
    return [
        frame.hex(" ") for frame in board.frames if frame[0] in KNOWN - GETS and not any(frame == one for one in left)
    ]


def careless(hand, link, exchanges, seed=0):
    """Run a program that takes no notice of errors: read, command, now and then limit, resynchronise when it fails."""
    random, send = np.random.default_rng(seed), hand._link._transport.write
    hand._link._transport.write = lambda data: (link.asked.append(bytes(data)), send(data))
    for _ in range(exchanges):
        try:
            what = random.integers(10)
            if what < 6:
                hand.command_codes(random.integers(0, 0x10000, 7))
            elif what < 9:
                hand.read_codes()
            else:
                hand.set_torque(Channel(int(random.integers(7))), int(random.integers(1024)))
        except AeroError:
            with suppress(AeroError):
                hand.resynchronise()
        link.clock.sleep_until(link.clock.now() + 0.02)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3])
@pytest.mark.parametrize("fault", ["stall", "swallow", "reboot", "split"])
def test_no_schedule_makes_a_board_execute_what_nobody_asked_for(new_board, caplog, fault, share):
    caplog.set_level(logging.ERROR)
    board = new_board()
    link = Faulty(board, fault, share)
    hand = AeroHand(link, link.clock)
    careless(hand, link, EXCHANGES)
    found = unasked(board, link.asked)
    print(f"| {fault} | {share:.0%} | {EXCHANGES} | {len(board.frames)} | {len(found)} |")
    assert not found


CODES = st.integers(0, 0xFFFF)
SEARCH_WRITES = [b"\0" * count for count in range(1, 16)] + [make_query(opcode) for opcode in sorted(GETS)]


def test_every_high_byte_makes_a_harmless_frame_at_every_alignment():
    """Rule 2 of `aero.link_state`, by exhaustion: where a board begins to read inside a write, it finds no command.

    A frame is read from one of its sixteen bytes on. Read from its first one it is the whole frame, which was meant.
    """
    for high, channel in itertools.product(range(256), range(7)):
        codes = [0] * 7
        codes[channel] = high << 8 | 0xFF
        frame = make_harmless_positions(codes)
        assert frame[:2] == bytes((CTRL_POS, 0))
        assert KNOWN.isdisjoint(frame[1:])
        sent = max(int.from_bytes(frame[at : at + 2], "little") for at in range(2, 16, 2))
        assert 0 <= codes[channel] - sent <= 1279


def test_the_search_spells_queries_alone_at_every_alignment():
    for write in SEARCH_WRITES:
        assert {byte for byte in write if byte in KNOWN} <= GETS


@given(
    writes=st.lists(
        st.one_of(st.sampled_from(SEARCH_WRITES), st.lists(CODES, min_size=7, max_size=7).map(make_harmless_positions))
    ),
    stray=st.integers(0, 15),
)
def test_no_sequence_of_such_writes_is_read_as_anything_else(new_board, writes, stray):
    """Whole writes, any of which may be swallowed, after any number of zeros that a search has left."""
    board = new_board()
    board.write(b"\0" * stray)
    for write in writes:
        board.write(write)
    assert {frame[0] for frame in board.frames} <= {*GETS, CTRL_POS} | {*range(256)} - KNOWN
    assert not unasked(board, writes)


def fail_to_search(board, hand):
    """Let a search fail whose single bytes are swallowed now and then, so that the board ends out of step."""
    write, count = board.write, itertools.count()
    board.write = lambda data: None if len(data) == 1 and next(count) % 3 == 0 else write(data)
    answers, board.replies = board.replies, dict.fromkeys(GETS, lambda frame: [])
    with pytest.raises(LinkTimeoutError, match="until a search succeeds"):
        hand.resynchronise()
    board.write, board.replies = write, answers


def test_after_a_search_that_failed_nothing_is_sent_until_one_succeeds(board):
    hand = AeroHand(board, board.clock)
    fail_to_search(board, hand)
    assert board.queue, "the board is out of step"
    sent = board.written
    calls = [
        hand.read_codes,
        hand.home,
        lambda: hand.command_codes([0x0101] * 7),
        lambda: hand.command_torques([1] * 7),
        lambda: hand.set_torque(Channel.INDEX, 0x0101),
        lambda: hand.trim(Channel.INDEX, 3),
        lambda: hand.set_id(1, 2),
    ]
    for call in calls:
        with pytest.raises(DesyncError, match=r"Nothing was sent. Call resynchronise\(\) until it succeeds"):
            call()
    assert board.written == sent
    hand.resynchronise()
    hand.command_codes([0x0101] * 7)
    assert board.frames[-1] == bytes([CTRL_POS, 0, *[1] * 14])


def test_a_hand_that_hears_and_does_not_speak_can_be_opened_after_a_search_that_failed(board):
    hand = AeroHand(board, board.clock)
    board.replies = dict.fromkeys(GETS, lambda frame: [])
    with pytest.raises(LinkTimeoutError):
        hand.resynchronise()
    hand.command_codes_blindly([0x12FF, 0x03FF, 0xFFFF, 0, 0, 0, 0])
    codes = [0x1000, 0, 0xFF00, 0, 0, 0, 0]
    assert board.frames[-1] == bytes([CTRL_POS, 0]) + wire(codes)


def wire(codes):
    """Return seven codes, command order, as the words of a frame: thumb first, docs/internals/driver.md."""
    order = [4, 5, 6, 0, 1, 2, 3]
    return b"".join(codes[channel].to_bytes(2, "little") for channel in order)


def test_the_fragment_of_a_real_frame_is_completed_by_a_search_only(new_board):
    board = new_board(gone_after=9)
    hand = AeroHand(board, board.clock)
    with pytest.raises(ConnectionError):
        hand.trim(Channel.INDEX, 300)
    board.gone_after = None
    with pytest.raises(DesyncError, match="gone out incomplete"):
        hand.command_codes_blindly([0] * 7)
    assert not board.frames


def test_the_tables_say_what_follows_in_every_state():
    assert AFTER.keys() == set(itertools.product(State, LinkEvent))
    assert MAY_LEAVE.keys() == set(State)
    for state in State:
        assert Content.SEARCH in MAY_LEAVE[state], "there is always a way back"
        assert AFTER[state, LinkEvent.SEARCH_SUCCEEDS] is State.IN_STEP
        assert Content.FRAME not in MAY_LEAVE[AFTER[state, LinkEvent.SEARCH_BEGINS]]
        assert MAY_LEAVE[AFTER[state, LinkEvent.WRITE_BEGINS]] == {Content.SEARCH}


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, ConnectionError, RuntimeError])
@pytest.mark.parametrize("count", range(17))
@pytest.mark.parametrize("call", ["command", "limit", "query"])
def test_a_write_that_anything_cuts_leads_to_nothing_that_nobody_asked_for(new_board, call, count, error):
    """Cut after each of its bytes, also after the last one: the program cannot know how many went out."""
    board = new_board()
    hand = AeroHand(board, board.clock)
    calls = {
        "command": lambda: hand.command_codes([0x3111] * 7),
        "limit": lambda: hand.set_torque(Channel.PINKY, 0x0111),
        "query": hand.read_codes,
    }
    hand.read_codes()
    write, asked = board.write, []

    def cut(data):
        asked.append(bytes(data))
        write(data[:count])
        raise error

    board.write = cut
    with pytest.raises(error):
        calls[call]()
    board.write = lambda data: (asked.append(bytes(data)), write(data))
    for again in calls.values():  # a program that takes no notice of it
        with suppress(DesyncError):
            again()
    hand.resynchronise()
    hand.command_codes([0x0101] * 7)
    fragment = asked[0][:count].ljust(16, b"\0")  # zeros alone complete it, which nobody can avoid
    assert not unasked(board, [fragment, *asked])
    assert board.frames[-1] == bytes([CTRL_POS, 0, *[1] * 14])
