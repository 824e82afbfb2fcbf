"""A link that was silent for a while and is well again is found soon, and no reading is given to the wrong request."""

import struct

import pytest
from guarded_hands import FailingLink, guarded, wait
from hypothesis import given
from hypothesis import strategies as st

from aero import AeroHand
from aero.driver import CURRENT_A_PER_UNIT, SPEED_RAD_PER_S_PER_UNIT
from aero.errors import AeroError
from aero.protocol import Opcode

FOUND_S = 0.2
READS = ("read_codes", "read_currents", "read_speeds", "read_temperatures")

UNITS = {"read_currents": CURRENT_A_PER_UNIT, "read_speeds": SPEED_RAD_PER_S_PER_UNIT}


@given(
    begins_s=st.floats(0.0, 0.3),
    silent_s=st.floats(0.02, 1.5),
    lost=st.sampled_from(["replies", "requests"]),
    program=st.tuples(
        st.lists(st.sampled_from(READS), min_size=1, max_size=5),
        st.sampled_from([0.0, 0.02, 0.05]),
    ),
)
def test_a_link_that_is_well_again_is_found_at_once(new_board, begins_s, silent_s, lost, program):
    """Every reply has a value of its own, so that one which is given to another request shows."""
    board, asked = new_board(), []
    reads, gap_s = program

    def answer(frame):
        asked.append(frame[0])
        return [(0.002, struct.pack("<BB7H", frame[0], 0, *[len(asked)] * 7))]

    board.replies = dict.fromkeys(range(0x22, 0x26), answer)
    hand = AeroHand(board, board.clock)
    well = begins_s + silent_s
    say, write = board.say, board.write

    def silent():
        return begins_s <= board.clock.now() < well

    if lost == "replies":
        board.say = lambda delay_s, data: None if silent() else say(delay_s, data)
    else:
        board.write = lambda data: None if silent() else write(data)
    number = 0
    while True:
        before = len(asked)
        read = reads[number % len(reads)]
        number += 1
        try:
            values = getattr(hand, read)()
        except AeroError:
            assert board.clock.now() < well + FOUND_S
            continue
        raw = round(float(values[0] / UNITS.get(read, 1.0)))
        assert before < raw <= len(asked)
        if board.clock.now() >= well:
            break
        board.clock.sleep_until(board.clock.now() + gap_s)
    assert board.clock.now() < well + FOUND_S + gap_s


@pytest.mark.parametrize("silent_s", [0.35, 0.45, 0.6, 0.75, 0.85, 0.9])
@pytest.mark.parametrize("after_s", [0.5, 0.513])
def test_a_healthy_hand_is_not_stopped_when_replies_were_lost_for_a_while(silent_s, after_s):
    with guarded(link=FailingLink) as target:
        target.hand.command_codes([20000] * 4 + [0] * 3)
        wait(target, after_s)
        link, electronics = target.wire._transport, target.truth.electronics
        link.silent = True
        electronics.kernel.call_at(target.clock.now() + silent_s, setattr, link, "silent", False)
        wait(target, silent_s + 0.5)
        asked = [data[0] for data in _written(target, 0.1)]
        assert {Opcode.GET_POS, Opcode.GET_CURR} <= {*asked}, "it is watched"


def _written(target, seconds):
    """Return what the guard writes while its program waits."""
    link = target.wire._transport
    link.log = []
    wait(target, seconds)
    return [data for _, way, data in link.log if way == ">"]
