"""The whole run, on bytes made by hand."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.protocol import BOOT_TEXT_MARKS
from hil.checks.session import check as whole_run
from hil.recordings.recording import DELAYS, Recording, delay_series
from hil.targets.delays import Delay, Loop
from hil.targets.wire_log import WireRecord
from tests.support.synthetic import HEADER


def measured(*exchanges):
    """Return what is measured on (opcode, pieces of the reply), one exchange each 100 ms."""
    wire = []
    for i, (opcode, *pieces) in enumerate(exchanges):
        wire.append(WireRecord(0.1 * i, "to_hand", bytes([opcode]) + bytes(15)))
        wire += [WireRecord(0.1 * i + 0.01 * (j + 1), "from_hand", piece) for j, piece in enumerate(pieces)]
    return whole_run.measure(Recording(HEADER, {}, tuple(wire)))["hand"]


def reply(opcode, size=16):
    return (bytes([opcode]) + bytes(size))[:size]


TEXT = BOOT_TEXT_MARKS[0] + b"!"
COUNTED = {
    "one of four without a reply, one with three bytes too many": (
        [(0x22, reply(0x22, size)) for size in (16, 0, 19, 16)], {"lost_replies": 25.0, "stray_bytes": 750.0},
    ),
    "a reply with the opcode of another request is none": (
        [(0x22, reply(0x22)), (0x22, reply(0x24)), (0x24, reply(0x24)), (0x22, reply(0x23))], {"lost_replies": 50.0},
    ),
    # As the driver does it: a query of another kind after 0.1 s, and the late reply and its own come one by one.
    "a reply that is late is not lost": (
        [(0x22,), (0x24, reply(0x22)), (0x11, reply(0x24)), (0x22,), (0x24, reply(0x22) + reply(0x24))], {},
    ),
    "a reply to a later request shows that the earlier one is lost": (
        [(0x22,), (0x24, reply(0x24)), (0x22, reply(0x22)), (0x25, reply(0x25))], {"lost_replies": 25.0},
    ),
    # Commands (0x11) and what lies beside the four measurements, 0x22 to 0x25, are answered otherwise.
    "only measurements lose a reply": (
        [*((opcode,) for opcode in (0x11, 0x21, 0x22, 0x23, 0x24, 0x25, 0x26)), (0x22, reply(0x22))],
        {"lost_replies": 80.0, "stalls": 1.0},
    ),
    "a reply in pieces is one reply": (
        [(0x22, reply(0x22, 7), bytes(9)), (0x25, bytes(15))], {"lost_replies": 50.0, "stray_bytes": 7500.0},
    ),
    "a boot text is a restart and no stray bytes": (
        [(0x22, reply(0x22)), (0x11, TEXT), (0x11, TEXT), (0x22, reply(0x22, 17))],
        {"stray_bytes": 250.0, "restarts": 2.0},
    ),
    # Firmware `pre` knows neither SET_SPE (0x31) nor SET_TOR (0x32).
    "limits that are not acknowledged": (
        [(0x31,), (0x22, reply(0x22)), (0x32, bytes(15))], {"stray_bytes": 5000.0, "unanswered_limits": 2.0},
    ),
    # As the driver does it: the same request twice and another behind it, answered one by one.
    "one limit that is lost, and pairs after it": (
        [
            (0x31,), (0x22, reply(0x22)),
            *[(0x31,), (0x31,), (0x23, reply(0x31), reply(0x31), reply(0x23))] * 20,
        ],
        {"unanswered_limits": 1.0},
    ),
    "limits that are": ([(0x31, reply(0x31)), (0x32, reply(0x32)), (0x33,)], {}),
}  # fmt: skip
NOTHING = {"lost_replies": 0.0, "stray_bytes": 0.0, "stalls": 0.0, "restarts": 0.0, "unanswered_limits": 0.0}


@pytest.mark.parametrize("case", COUNTED)
def test_what_the_bytes_of_a_session_say_is_counted(case):
    made, expected = COUNTED[case]
    assert measured(*made) == pytest.approx(NOTHING | expected)


def test_bytes_before_the_first_request_and_a_run_without_any_are_nothing():
    early = Recording(HEADER, {}, (WireRecord(0.0, "from_hand", bytes(5)),))
    assert whole_run.measure(early)["hand"] == NOTHING


@pytest.mark.parametrize(("waited_s", "held_up_s", "expected"), [(0.1, 0.0, 0.0), (0.4, 0.0, 1.0), (0.4, 0.3, 0.0)])
def test_a_link_stands_still_where_nothing_comes_for_long_and_the_computer_was_free(waited_s, held_up_s, expected):
    """A hub that stalled now and then was not found: each reading that it spoiled was left out."""
    first, late = bytes([0x22]) + bytes(15), bytes([0x24]) + bytes(15)
    wire = (
        WireRecord(1.0, "to_hand", first),
        WireRecord(1.1, "to_hand", late),
        WireRecord(1.0 + waited_s, "from_hand", first),
        WireRecord(1.0 + waited_s, "from_hand", late),
    )
    delays = delay_series([Delay(1.35, held_up_s, Loop.PROGRAM)] if held_up_s else [])
    recording = Recording(HEADER, {} if delays is None else {DELAYS: delays}, wire)
    assert whole_run.measure(recording)["hand"]["stalls"] == expected


@given(st.lists(st.sampled_from((0x22, 0x24, 0x31, 0x32)), min_size=1, max_size=30), st.data())
def test_each_lost_reply_counts_once_however_late_the_others_come(opcodes, data):
    """One lost acknowledgement counted 43 times, for the driver sent pairs after it."""
    lost = data.draw(st.sets(st.integers(0, len(opcodes) - 1)))
    late = data.draw(st.integers(0, 3))
    due = [[reply(opcode)] if at not in lost else [] for at, opcode in enumerate(opcodes)]
    answers = [*[[] for _ in range(late)], *due]
    behind = [piece for pieces in answers[len(opcodes) :] for piece in pieces]
    found = measured(*((opcode, *pieces) for opcode, pieces in zip(opcodes, answers, strict=False)), (0x11, *behind))
    assert found["unanswered_limits"] == sum(opcodes[at] > 0x30 for at in lost)


@pytest.mark.parametrize("delayed", [False, True])
def test_losses_while_this_computer_was_held_up_are_excused(delayed):
    wire = (
        WireRecord(1.0, "to_hand", bytes([0x31]) + bytes(15)),
        WireRecord(1.1, "to_hand", bytes([0x22]) + bytes(15)),
        WireRecord(1.11, "from_hand", reply(0x22, 19)),
        WireRecord(1.2, "to_hand", bytes([0x22]) + bytes(15)),
        WireRecord(1.3, "to_hand", bytes([0x24]) + bytes(15)),
        WireRecord(1.31, "from_hand", reply(0x24)),
    )
    delays = [Delay(1.105, 0.05, Loop.PROGRAM), Delay(1.3, 0.02, Loop.BOARD)] if delayed else []
    series = {DELAYS: delay_series(delays)} if delayed else {}
    found = whole_run.measure(Recording(HEADER, series, wire))["hand"]
    lost = [found[name] for name in ("lost_replies", "stray_bytes", "unanswered_limits")]
    assert all(value == 0.0 for value in lost) if delayed else all(value > 0.0 for value in lost)


@pytest.mark.parametrize(("turned", "replies", "expected"), [(b"", 512, 0.0), (b"\r", 512, 1.0), (b"\r", 99, None)])
def test_a_port_that_turns_line_ends_leaves_a_value_that_no_position_has(turned, replies, expected):
    wire = []
    for i in range(replies):
        data = bytes((i + 37 * j) % 256 for j in range(14))
        data = data.replace(turned, b"\n") if turned else data
        wire.append(WireRecord(0.01 * i, "to_hand", bytes([0x22]) + bytes(15)))
        wire.append(WireRecord(0.01 * i, "from_hand", bytes([0x22, 0]) + data))
    assert whole_run.measure(Recording(HEADER, {}, tuple(wire)))["hand"].get("absent_values") == expected
