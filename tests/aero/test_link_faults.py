"""What a link may do to replies, and what the driver makes of it: never a shifted value, never an old one as fresh.

Every reply of the board says how many requests it has seen, in all seven words, so that a late or a shifted one shows.
The counts of docs/internals/driver.md: `LINK_EXCHANGES=1000000 pytest -s tests/aero/test_link_faults.py -k schedule`.
"""

import os
from collections import Counter

import numpy as np
import pytest

from aero import AeroHand, Channel
from aero.errors import AeroError, DesyncError, LinkTimeoutError
from aero.overdue import LATE_S

EXCHANGES = int(os.environ.get("LINK_EXCHANGES", "600"))


@pytest.fixture
def counting(counting_board):
    return counting_board, AeroHand(counting_board, counting_board.clock)


@pytest.mark.parametrize("delay_s", [0.06, 0.08])
def test_a_late_value_that_looks_like_the_start_of_a_reply_is_not_taken_for_one(new_board, delay_s):
    """Temperatures of 34 to 37 degrees are the opcodes of the four readings.

    The positions are late, so that temperatures are asked for meanwhile; these arrive when speeds are waited for, whose
    reply comes in two pieces.
    """
    board = new_board()
    board.words = {opcode: [0x22, 0x24, 0x23, 0x25, 0x22, 0x24, 0x23] for opcode in range(0x22, 0x26)}
    board.words[0x23] = [1, 2, 3, 4, 5, 6, 7]
    hand = AeroHand(board, board.clock)
    delays, gaps = iter([0.15, delay_s]), iter([0.0, 0.0, 0.06])
    spoil(board, lambda data: [(next(delays, 0.0), data[:6]), (next(gaps, 0.0), data[6:])])
    assert hand.read_codes().tolist() == [0x25, 0x22, 0x24, 0x23, 0x22, 0x24, 0x23]
    for _ in range(3):
        assert np.rint(hand.read_speeds() / (0.732 * 2 * np.pi / 60)).tolist() == [4, 5, 6, 7, 1, 2, 3]


def spoil(board, change):
    """Let `change` make [(delay, bytes), ...] of a delay and bytes that the board sends; order is kept."""
    say, last = board.say, [0.0]

    def spoiled(delay_s, data):
        for more_s, part in change(data):
            last[0] = max(last[0], board.clock.now() + delay_s + more_s)
            say(last[0] - board.clock.now(), part)

    board.say = spoiled


def test_a_reply_that_is_late_is_waited_for(counting):
    board, hand = counting
    spoil(board, lambda data: [(0.9, data)])
    assert hand.read_codes().tolist() == [board.value(1)] * 7
    assert hand.reading_age_s == pytest.approx(0.9, abs=0.01)


def test_a_reply_that_is_later_than_that_is_never_taken_for_another(counting):
    """It arrives while the next reading is under way."""
    board, hand = counting
    delays = iter([1.3])
    spoil(board, lambda data: [(next(delays, 0.0), data)])
    with pytest.raises(LinkTimeoutError):
        hand.read_codes()
    before = board.seen
    assert hand.read_codes()[0] in {board.value(count) for count in range(before + 1, board.seen + 1)}


def test_an_acknowledgement_with_surplus_bytes_is_asked_for_again(counting):
    board, hand = counting
    surplus = iter([b"\x32"])
    spoil(board, lambda data: [(0.0, data + next(surplus, b""))])
    hand.set_torque(Channel.INDEX, 500)
    assert [frame[0] for frame in board.frames].count(0x32) == 2


def test_what_may_not_be_repeated_fails_when_its_reply_is_disturbed(counting):
    board, hand = counting
    spoil(board, lambda data: [(0.0, data + b"\x03")])
    with pytest.raises(DesyncError):
        hand.trim(Channel.INDEX, 10)
    assert [frame[0] for frame in board.frames].count(0x03) == 1


def duplicated(data, random):
    at = random.integers(16)
    return [(0.0, data[: at + 1] + data[at:])]


def inserted(data, random):
    at = random.integers(17)
    return [(0.0, data[:at] + random.bytes(1) + data[at:])]


def dropped(data, random):
    at = random.integers(16)
    return [(0.0, data[:at] + data[at + 1 :])]


def lost(data, random):
    return []


def late(data, random):
    return [(random.uniform(0.0, 0.5), data)]


def stalled(data, random):
    return [(random.uniform(0.0, 1.9), data)]


def split(data, random):
    at = random.integers(1, 16)
    return [(0.0, data[:at]), (random.uniform(0.0, 0.05), data[at:])]


SCHEDULES = [duplicated, inserted, dropped, lost, late, stalled, split]


@pytest.mark.parametrize("share", [0.05, 0.3])
@pytest.mark.parametrize("fault", SCHEDULES)
def test_no_schedule_of_faults_yields_a_shifted_or_an_old_value(counting, fault, share):
    board, hand = counting
    random, found = np.random.default_rng(7), Counter()
    spoil(board, lambda data: fault(data, random) if random.uniform() < share else [(0.0, data)])
    for _ in range(EXCHANGES):
        before, start = board.seen, board.clock.now()
        try:
            words = set(hand.read_codes().tolist())
        except AeroError:
            found["errors"] += 1
        else:
            fresh = {board.value(count) for count in range(before + 1, board.seen + 1)}
            found["shifted" if len(words) > 1 else "right" if words <= fresh else "old"] += 1
        assert board.clock.now() - start < 2.5
    print(fault.__name__, share, dict(found))
    assert found["shifted"] == found["old"] == 0


def flipped(data, random):
    bit = random.integers(128)
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << bit % 8
    return [(0.0, bytes(changed))]


def lost_and_inserted(data, random):
    at, elsewhere = random.integers(16, size=2)
    short = data[:at] + data[at + 1 :]
    return [(0.0, short[:elsewhere] + random.bytes(1) + short[elsewhere:])]


@pytest.mark.parametrize("fault", [flipped, lost_and_inserted])
def test_what_no_driver_can_see_in_a_frame_without_a_checksum(counting, fault):
    """Shares of docs/internals/driver.md: spoiled replies that pass for right ones with wrong values."""
    board, hand = counting
    random, found = np.random.default_rng(7), Counter()
    spoiled = [False]

    def sometimes(data):
        now = random.uniform() < 0.3
        spoiled[0] |= now
        found["spoiled"] += now
        return fault(data, random) if now else [(0.0, data)]

    spoil(board, sometimes)
    for _ in range(3 * EXCHANGES):
        board.clock.sleep_until(board.clock.now() + LATE_S)  # else it compares two replies after one that it missed
        try:
            words = hand.read_codes().tolist()
        except AeroError:
            continue
        right = words == [board.value(board.seen)] * 7
        found["unseen" if spoiled[0] and not right else "right"] += 1
        assert right or spoiled[0]
    share = found["unseen"] / found["spoiled"]
    print(fault.__name__, f"{share:.2f}")
    assert 0.5 < share < 1.0
