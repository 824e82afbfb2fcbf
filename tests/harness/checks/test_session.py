"""The whole run, on bytes made by hand."""

import pytest

from aero.protocol import BOOT_TEXT_MARKS
from hil.checks.session import check as whole_run
from hil.recordings.recording import Recording
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


def test_lost_replies_and_stray_bytes_of_a_session_are_counted():
    """Of four requests one stays without a reply and one reply has three bytes too many."""
    found = measured(*((0x22, reply(0x22, size)) for size in (16, 0, 19, 16)))
    assert found == pytest.approx(
        {"lost_replies": 25.0, "stray_bytes": 750.0, "restarts": 0.0, "unanswered_limits": 0.0}
    )


def test_a_reply_with_the_opcode_of_another_request_is_none():
    found = measured((0x22, reply(0x22)), (0x22, reply(0x24)), (0x24, reply(0x24)), (0x22, reply(0x23)))
    assert found["lost_replies"] == pytest.approx(50.0)
    assert found["stray_bytes"] == 0.0


def test_a_reply_that_is_late_is_not_lost():
    """As the driver does it: a query of another kind after 0.1 s, and the late reply and its own come one by one."""
    found = measured((0x22,), (0x24, reply(0x22)), (0x11, reply(0x24)), (0x22,), (0x24, reply(0x22) + reply(0x24)))
    assert found == {"lost_replies": 0.0, "stray_bytes": 0.0, "restarts": 0.0, "unanswered_limits": 0.0}


def test_a_reply_to_a_later_request_shows_that_the_earlier_one_is_lost():
    found = measured((0x22,), (0x24, reply(0x24)), (0x22, reply(0x22)), (0x25, reply(0x25)))
    assert found["lost_replies"] == pytest.approx(25.0)


def test_only_measurements_can_lose_a_reply():
    """Commands (0x11) and what lies beside the four measurements, 0x22 to 0x25, are answered otherwise."""
    found = measured(*((opcode,) for opcode in (0x11, 0x21, 0x22, 0x23, 0x24, 0x25, 0x26)), (0x22, reply(0x22)))
    assert found["lost_replies"] == pytest.approx(80.0)


def test_a_reply_in_pieces_is_one_reply():
    found = measured((0x22, reply(0x22, 7), bytes(9)), (0x25, bytes(15)))
    assert found == pytest.approx(
        {"lost_replies": 50.0, "stray_bytes": 7500.0, "restarts": 0.0, "unanswered_limits": 0.0}
    )


def test_a_boot_text_is_a_restart_and_no_stray_bytes():
    text = BOOT_TEXT_MARKS[0] + b"!"
    found = measured((0x22, reply(0x22)), (0x11, text), (0x11, text), (0x22, reply(0x22, 17)))
    assert found == pytest.approx(
        {"lost_replies": 0.0, "stray_bytes": 250.0, "restarts": 2.0, "unanswered_limits": 0.0}
    )


def test_bytes_before_the_first_request_and_a_run_without_any_are_nothing():
    early = Recording(HEADER, {}, (WireRecord(0.0, "from_hand", bytes(5)),))
    assert whole_run.measure(early)["hand"] == {
        "lost_replies": 0.0,
        "stray_bytes": 0.0,
        "restarts": 0.0,
        "unanswered_limits": 0.0,
    }


def test_a_limit_that_is_not_acknowledged_is_counted():
    """Firmware `pre` knows neither SET_SPE (0x31) nor SET_TOR (0x32)."""
    assert measured((0x31,), (0x22, reply(0x22)), (0x32, bytes(15)))["unanswered_limits"] == 2.0
    assert measured((0x31, reply(0x31)), (0x32, reply(0x32)), (0x33,))["unanswered_limits"] == 0.0
