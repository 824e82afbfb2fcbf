import struct
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero import AeroHand, Channel
from aero.errors import DesyncError, LinkTimeoutError, NoTelemetryError, RefusedError
from aero.protocol import READINGS, Centred, Opcode, Trimmed

POSITIONS_WIRE = [0x2200 + i for i in range(7)]
POSITIONS = [*POSITIONS_WIRE[3:], *POSITIONS_WIRE[:3]]


def reply(opcode, words):
    return struct.pack("<BB7H", opcode, 0, *words)


@pytest.fixture
def hand(board):
    return AeroHand(board, board.clock)


def test_positions_are_read_in_command_order(hand):
    codes = hand.read_codes()
    assert codes.dtype == np.uint16
    assert codes.tolist() == POSITIONS


def test_readings_carry_their_units(hand, board):
    board.words[0x24] = [0xFFFF, 100, 0, 0, 0, 0, 0]
    board.words[0x23] = [0xFFFF, 1000, 0, 0, 0, 0, 0]
    board.words[0x25] = [20, 21, 22, 30, 31, 32, 33]
    np.testing.assert_allclose(hand.read_currents(), [0, 0, 0, 0, -0.0065, 0.65, 0])
    np.testing.assert_allclose(hand.read_speeds()[4:], np.array([-1, 1000, 0]) * 0.732 * 2 * np.pi / 60)
    np.testing.assert_array_equal(hand.read_temperatures(), [30, 31, 32, 33, 20, 21, 22])


def test_commands_go_out_as_one_frame_and_wait_for_nothing(hand, board):
    hand.command_codes([1, 2, 3, 4, 5, 6, 7])
    hand.command_torques([11, 12, 13, 14, 15, 16, 17])
    assert board.frames == [reply(0x11, [5, 6, 7, 1, 2, 3, 4]), reply(0x12, [15, 16, 17, 11, 12, 13, 14])]
    assert board.clock.now() == 0.0


codes = st.lists(st.integers(0, 65535), min_size=7, max_size=7)


@given(st.lists(st.tuples(codes, st.sampled_from(["position", "torque", "then read"])), min_size=1, max_size=8))
def test_every_command_is_on_the_wire_when_its_call_returns_and_none_before_it(new_board, commands):
    """Neither kept for the next call nor sent twice; the board's own count of bytes says so after every call."""
    board = new_board()
    hand = AeroHand(board, board.clock)
    for values, kind in commands:
        wire, before = [*values[4:], *values[:4]], len(board.frames)
        if kind == "torque":
            hand.command_torques([value % 1001 for value in values])
            assert board.frames[before:] == [reply(0x12, [value % 1001 for value in wire])]
            continue
        hand.command_codes(values)
        assert board.frames[before:] == [reply(0x11, wire)]
        assert board.written == 16 * len(board.frames)
        if kind == "then read":
            hand.read_codes()
            assert {frame[0] for frame in board.frames[before + 1 :]} <= {0x22, 0x25}


def test_settings_are_confirmed_by_the_board(hand, board):
    hand.set_speed(Channel.THUMB_FLEXOR, 2400)
    hand.set_torque(Channel.INDEX, 700)
    assert board.frames == [reply(0x31, [2, 2400, 0, 0, 0, 0, 0]), reply(0x32, [3, 700, 0, 0, 0, 0, 0])]
    assert hand.trim(Channel.INDEX, -100) == Trimmed(2141, None)
    assert hand.set_id(3, 500) == 9
    hand.home()
    assert board.frames[-1] == reply(0x01, [0] * 7)


def test_after_homing_the_first_reading_is_not_older_than_the_homing(hand, board):
    board.replies[0x01] = lambda frame: [(4.0, reply(0x01, [0] * 7))]
    hand.home()
    # Two telemetry periods of the slowest firmware.
    assert board.clock.now() >= 4.04


@pytest.mark.parametrize(
    ("words", "error", "says"),
    [
        ([0xFFFF, 0, 0, 0, 0, 0, 0], RefusedError, "knows no channel 3"),
        ([3, 699, 0, 0, 0, 0, 0], RefusedError, "stored 699"),
        ([4, 700, 0, 0, 0, 0, 0], DesyncError, "answered about 4"),
    ],
)
def test_a_setting_that_was_not_taken_is_an_error(hand, board, words, error, says):
    board.replies[0x32] = lambda frame: [(0.001, reply(0x32, words))]
    with pytest.raises(error, match=says):
        hand.set_torque(Channel.INDEX, 700)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([0xFF, 3, 0], "no servo"),
        ([0xFFFF, 0xFFFF, 0xFFFF], "more than one"),
        ([1, 3, 0], "limit 500, the servo says 3"),
    ],
)
def test_a_refused_id_says_why(hand, board, words, says):
    board.replies[0x02] = lambda frame: [(0.001, reply(0x02, [*words, 0, 0, 0, 0]))]
    with pytest.raises(RefusedError, match=says):
        hand.set_id(3, 500)


@given(
    expected=st.tuples(st.sampled_from([0x22, 0x25, 0x24]), st.lists(st.integers(1, 65535), min_size=7, max_size=7)),
    before=st.sampled_from(["nothing", "boot text", "late reply", "fragment"]),
    pieces=st.lists(st.tuples(st.integers(1, 30), st.floats(0.0, 0.01)), max_size=6),
)
def test_split_delayed_and_disturbed_replies_are_read(new_board, boot_text, expected, before, pieces):
    opcode, words = expected
    board = new_board()
    hand = AeroHand(board, board.clock)
    noise = {
        "nothing": b"",
        "boot text": boot_text,
        "late reply": reply(0x23, [7] * 7),
        "fragment": reply(opcode, [7] * 7)[5:],
    }[before]

    def disturbed(frame):
        stream, time = noise + reply(opcode, words), 0.0
        for size, gap_s in [*pieces, (len(stream), 0.001)]:
            time += gap_s
            yield time, stream[:size]
            stream = stream[size:]

    board.replies[opcode] = disturbed
    read = {0x22: hand.read_codes, 0x25: hand.read_temperatures, 0x24: hand.read_currents}[opcode]
    signed = np.array(words, np.uint16).view(np.int16) * 0.0065
    values = signed if opcode == 0x24 else np.array(words)
    np.testing.assert_allclose(read(), values[[3, 4, 5, 6, 0, 1, 2]])
    assert bool(hand.boot_text) == (before == "boot text")


def test_a_lost_reply_is_asked_for_again(hand, board):
    answers = iter([[], [], []])
    board.replies[0x22] = lambda frame: next(answers, [(0.001, reply(0x22, POSITIONS_WIRE))])
    assert hand.read_codes().tolist() == POSITIONS
    assert [frame[0] for frame in board.frames].count(0x22) == 5, "twice after those that were lost, to compare"


def test_a_telnet_server_is_named(hand, board):
    """`socket://` at a port that is served for `rfc2217://`."""
    board.replies[0x22] = lambda frame: []
    board.say(0.01, bytes.fromhex("fffb01 fffb03 fffd00 fffb2c"))
    with pytest.raises(DesyncError, match=r"Telnet server .*rfc2217://HOST:PORT"):
        hand.read_codes()


def test_stale_bytes_from_before_the_request_are_dropped(hand, board):
    board.say(0.0, reply(0x22, [1] * 7))
    assert hand.read_codes().tolist() == POSITIONS


def test_acknowledged_settings_are_never_repeated(hand, board):
    board.replies[0x03] = lambda frame: []
    with pytest.raises(LinkTimeoutError, match="no reply to TRIM within 2 s"):
        hand.trim(Channel.INDEX, 10)
    assert len(board.frames) == 1


def test_a_silent_board_is_a_time_out_within_the_time_given(hand, board):
    board.replies[0x22] = lambda frame: []
    board.words = {}
    with pytest.raises(LinkTimeoutError, match=r"mini board: no reply to GET_POS within 1 s.*homing"):
        hand.read_codes()
    assert board.clock.now() < 1.05


def test_boot_text_instead_of_a_reply_says_that_the_board_restarted(hand, board, boot_text):
    board.replies[0x22] = lambda frame: [(0.001, boot_text)]
    with pytest.raises(DesyncError, match=r"only boot text.*restarted"):
        hand.read_codes()
    assert "[BOOT] Hand Type: RIGHT_HAND" in hand.boot_text


def test_other_bytes_instead_of_a_reply_are_shown(hand, board):
    board.replies[0x22] = lambda frame: [(0.001, b"\xaa\xbb")]
    with pytest.raises(DesyncError, match="aa bb"):
        hand.read_codes()


def test_a_port_that_never_stops_talking_is_no_hand(hand, board):
    for i in range(400):
        board.say(0.005 * i, b"noise")
    board.replies[0x22] = lambda frame: []
    with pytest.raises(DesyncError, match="without a request"):
        hand.read_codes()


def test_all_zero_since_the_start_is_not_passed_off_as_a_reading(hand, board):
    board.words = {opcode: [0] * 7 for opcode in range(0x22, 0x26)}
    for read in (hand.read_codes, hand.read_currents, hand.read_speeds, hand.read_temperatures):
        with pytest.raises(NoTelemetryError, match="missing servo"):
            read()


def test_an_open_hand_at_rest_may_read_zero(hand, board):
    board.words[0x22] = board.words[0x24] = [0] * 7
    assert not hand.read_codes().any()
    asked = len(board.frames)
    assert not hand.read_currents().any()
    assert len(board.frames) == asked + 1


def test_the_first_telemetry_cycle_is_waited_for(hand, board):
    def warming_up(opcode):
        return lambda frame: [
            (0.001, reply(opcode, [25] * 7 if opcode == 0x25 and board.clock.now() > 0.01 else [0] * 7))
        ]

    board.replies = {opcode: warming_up(opcode) for opcode in (0x22, 0x25)}
    assert not hand.read_codes().any()
    assert board.clock.now() > 0.01


def test_telemetry_has_to_be_seen_again_after_a_restart(hand, board, boot_text):
    hand.read_codes()
    board.say(0.0, boot_text)
    board.words = {opcode: [0] * 7 for opcode in range(0x22, 0x26)}
    with pytest.raises(NoTelemetryError):
        hand.read_codes()


@pytest.mark.parametrize("stray", range(16))
@pytest.mark.parametrize(("late_s", "within_s"), [(0.001, 2.5), (0.15, 7.0), (0.45, 7.0), (0.9, 7.0)])
def test_a_board_stuck_on_stray_bytes_is_brought_back_even_if_it_answers_late(board, stray, late_s, within_s):
    """A late reply comes when other frame starts are being tried."""
    board.delay_s = late_s
    board.write(b"\x7f" * stray)
    hand = AeroHand(board, board.clock)
    assert hand.resynchronise() == stray
    assert hand.read_codes().tolist() == POSITIONS
    assert {frame[0] for frame in board.frames} <= {0x7F, 0x00, *READINGS}
    assert board.clock.now() < within_s


def test_replies_from_before_do_not_mislead_the_search_for_the_frame_start(board):
    """All replies come after 1.3 s, those to a reading that has been given up first."""

    def held_back(frame):
        return [(max(0.001, 1.3 - board.clock.now()), board.answer(frame)[0][1])]

    board.replies = dict.fromkeys(READINGS, held_back)
    hand = AeroHand(board, board.clock)
    with pytest.raises(LinkTimeoutError):
        hand.read_codes()
    assert hand.resynchronise() == 0
    assert hand.read_codes().tolist() == POSITIONS


def test_a_board_that_stays_silent_cannot_be_resynchronised(hand, board):
    board.replies = dict.fromkeys(READINGS, lambda frame: [])
    with pytest.raises(LinkTimeoutError, match="none of the 16 possible"):
        hand.resynchronise()


def test_leaving_the_context_closes_the_link(board):
    with AeroHand(board, board.clock) as hand:
        assert hand.name == "mini board"
    assert board.closed


def test_threads_take_turns(board):
    hand = AeroHand(board, board.clock)
    both_inside, met, answer = threading.Barrier(2), [], board.answer

    def slow_answer(frame):
        try:
            met.append(both_inside.wait(0.05))
        except threading.BrokenBarrierError:
            return answer(frame)
        return answer(frame)

    board.replies[0x22] = slow_answer
    threads = [threading.Thread(target=hand.read_codes) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not met


def test_a_calibration_goes_out_once_and_says_where_the_servo_stands(hand, board):
    board.replies[0x04] = lambda frame: [(0.04, reply(0x04, [3, 2051, 24550, 0, 1, 0, 0]))]
    assert hand.calibrate_mid(Channel.INDEX) == Centred(2051, 24550, True)
    assert board.frames == [reply(0x04, [3, 0, 0, 0, 0, 0, 0])]
    board.replies[0x04] = lambda frame: [(0.04, reply(0x04, [3, 2097, 24000, 1, 1, 0, 0]))]
    assert not hand.calibrate_mid(Channel.INDEX).near_middle


def test_a_calibration_that_was_refused_says_why(hand, board):
    board.replies[0x04] = lambda frame: [(0.001, reply(0x04, [3, 0xFFFF, 0, 1, 1, 0, 0]))]
    with pytest.raises(RefusedError, match=r"index was not calibrated.*torque mode"):
        hand.calibrate_mid(Channel.INDEX)


@pytest.mark.parametrize(
    ("words", "position"),
    [([3, 2141, 1998, 0, 1, 0, 0], 1998), ([3, 2141, 0xFFFF, 0, 1, 0, 0], None), ([3, 2141, 0, 0, 0, 0, 0], None)],
)
def test_the_longer_acknowledgement_of_a_trim_tells_where_the_servo_stands(hand, board, words, position):
    board.replies[0x03] = lambda frame: [(0.001, reply(0x03, words))]
    assert hand.trim(Channel.INDEX, -100) == Trimmed(2141, position)


def test_a_board_that_is_silent_about_calibration_is_older_than_main(hand, board):
    board.replies[0x04] = lambda frame: []
    assert not hand.knows(Opcode.CALIBRATE_MID)
    # Channel 7, which no board has; nothing of it can move a hand.
    assert board.frames[0] == reply(0x04, [7, 0, 0, 0, 0, 0, 0])
    with pytest.raises(LinkTimeoutError, match="too old for CALIBRATE_MID"):
        hand.calibrate_mid(Channel.INDEX)
    board.replies[0x04] = lambda frame: [(0.001, reply(0x04, [7, 0xFFFF, 0, 1, 1, 0, 0]))]
    assert hand.knows(Opcode.CALIBRATE_MID)
