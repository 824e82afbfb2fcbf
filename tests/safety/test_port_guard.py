"""A guard between a scripted client and an emulated hand, in virtual time: the client's end, and a healthy client."""

import itertools
import os
import struct

import numpy as np
import pytest
from guarded_port import FIST, guarded_port, stream
from hypothesis import given, settings
from hypothesis import strategies as st
from sdk_session import sdk_frames

from aero.protocol import (
    FRAME_SIZE,
    MAX_CODE,
    READINGS,
    Opcode,
    make_positions,
    make_query,
    make_torques,
    parse_reply,
    unsigned_values,
)
from aero.safety import Region, SafetyReason, Thresholds
from aero.safety.port_guard import PortState
from aero.safety.shared_port import SharedPort
from hil.emulated.faults import parse_fault

LIMP = Thresholds().limp_torque
OPEN_DEG = 25.0
"""No joint of an open hand is bent further: a thumb joint rests at 19 degrees in the windows of firmware 0.1.0."""
GRIPS = {
    "fist": [0.9] * 4 + [0, 0, 0],
    "pinch": [0.6, 0, 0, 0, 0.7, 0.4, 0.3],
}
BEGIN_S, END_S = 0.5, 2.5
"""Begin and end of the client, s."""
QUESTION = make_query(Opcode.GET_POS)


def killed(port, t):
    port.line.present = (0.0, t)


def killed_in_a_frame(port, t):
    port.line.script.append((t, FIST[:7]))
    killed(port, t)


def hung(port, t):
    pass


def killed_in_a_flood(port, t):
    """Three thousand commands and questions a second."""
    rng = np.random.default_rng(1)
    for step in range(3000):
        codes = rng.integers(30000, MAX_CODE, 7)
        port.line.script.append((t + step / 3000, make_positions(codes) + QUESTION))
    killed(port, t + 1.0)


def killed_among_numbers_that_are_none(port, t):
    """Not a number as half, single and double precision in place of codes, and noise."""
    rng = np.random.default_rng(2)
    nan = float("nan")
    half, single, double = (
        struct.pack("<7e", *[nan] * 7),
        struct.pack("<3f2x", nan, -nan, nan),
        struct.pack("<d6x", nan),
    )
    bodies = [half, single, double, b"\xff" * 14]
    for step in range(200):
        head = bytes([(Opcode.CTRL_POS, 0x21, 0x7F)[step % 3], step % 2])
        noise = bytes([0x80 | int(rng.integers(128))]) + rng.bytes(FRAME_SIZE - 1)
        port.line.script.append((t + step * 0.01, (head + bodies[step % 4]) if step % 5 else noise))
    killed(port, t + 2.0)


def killed_in_torque_mode(port, t):
    port.line.script += [(t, make_torques([150] * 4 + [0] * 3)), (t + 1.0, make_torques([1000] * 4 + [0] * 3))]
    killed(port, t + 1.1)


def alive_in_torque_mode(port, t):
    port.line.script += [(t + 0.1 * step, make_torques([1000] * 4 + [0] * 3)) for step in range(100)]


def board_restarted(port, t):
    port.electronics.kernel.call_at(t, port.electronics.reset, "reset")
    port.line.script += [(t + 0.01 * step, FIST + QUESTION) for step in range(1500)]


def board_without_power_for_a_moment(port, t):
    port.electronics.kernel.call_at(t, port.electronics.reset, "power_on")
    killed(port, t + 0.1)


def usb_gone_for_a_while(port, t):
    port.line.unplugged = (t, t + 4.0)
    port.line.script += [(t + 0.01 * step, FIST) for step in range(1000)]


def killed_in_a_homing(port, t):
    port.line.script.append((t, make_query(Opcode.HOMING)))
    killed(port, t + 0.3)


ENDS = [
    killed, killed_in_a_frame, hung, killed_in_a_flood, killed_among_numbers_that_are_none, killed_in_torque_mode,
    alive_in_torque_mode, board_restarted, board_without_power_for_a_moment, usb_gone_for_a_while,
]  # fmt: skip
FIRMWARES = ["pre", "0.1.0", "0.1.5", "0.2.0"]
UNKNOWN_TO_PRE = {killed_in_torque_mode, alive_in_torque_mode}
CASES = [
    case if case[:2] == ("0.2.0", "fist") else pytest.param(*case, marks=pytest.mark.slow)
    for case in itertools.product(FIRMWARES, GRIPS, ENDS)
    if case[0] != "pre" or case[2] not in UNKNOWN_TO_PRE
]


@pytest.mark.parametrize(("firmware", "grip", "end"), CASES)
def test_no_end_of_a_client_leaves_a_hand_closed(firmware, grip, end):
    with guarded_port(firmware=firmware) as port:
        t = port.line.clock.now()
        port.line.script += stream(t + BEGIN_S, END_S - BEGIN_S, [GRIPS[grip]])
        end(port, t + END_S)
        found = port.run(45.0)
    assert (found.state, port.stops[-1].doubt) == (PortState.REFUSING, None), port.stops
    assert found.bend_deg < OPEN_DEG
    assert firmware == "pre" or found.torque == LIMP


def test_a_hand_that_does_not_open_is_said_to_be_in_doubt():
    """The opening ends with a doubt, and is begun again; it is no wait for a homing that nobody asked for."""
    with guarded_port() as port:
        t = port.line.clock.now()
        port.line.script += stream(t + BEGIN_S, END_S - BEGIN_S, [GRIPS["fist"]])
        jam = parse_fault("gear_jammed:ring")
        port.electronics.kernel.call_at(t + END_S, port.workbench.inject, jam)
        killed(port, t + END_S)
        found = port.run(30.0)
    assert found.state is PortState.OPENING
    assert port.stops[-1].doubt


@pytest.mark.parametrize("firmware", ["0.1.5", "0.2.0"])
def test_a_client_that_ends_with_the_hand_open_is_no_stop(firmware):
    """This one ends in the middle of a homing, after which the hand is open."""
    with guarded_port(firmware=firmware) as port:
        t = port.line.clock.now()
        port.line.script += stream(t + BEGIN_S, END_S - BEGIN_S, [GRIPS["fist"]])
        port.line.script += stream(t + END_S, 1.0, [[0.0] * 7])
        killed_in_a_homing(port, t + END_S + 1.0)
        found = port.run(20.0)
    assert (found.state, port.stops) == (PortState.PASSING, [])
    assert found.bend_deg < OPEN_DEG


def test_a_word_from_before_a_stop_does_not_resume_and_one_after_it_does():
    with guarded_port() as port:
        t = port.line.clock.now()
        port.line.script += stream(t + BEGIN_S, END_S - BEGIN_S, [GRIPS["fist"]])
        killed(port, t + END_S)

        def resumed_until_it_stops():
            if not port.stops:
                port.guard.resume()
            return bool(port.stops) or port.line.clock.now() > t + 20.0

        port.guard.run(resumed_until_it_stops)
        assert port.guard.state is PortState.REFUSING
        port.line.present = (0.0, port.line.clock.now() + 60.0)
        now = port.line.clock.now()
        port.line.script.append((now + 0.5, FIST))
        port.line.script.append((now + 1.5, FIST))
        port.guard.run(lambda: port.line.clock.now() > now + 1.0)
        assert (port.guard.state, port.guard.refused) == (PortState.REFUSING, 1)
        port.guard.resume()
        found = port.run(2.0)
    assert (found.state, port.said) == (PortState.PASSING, ["resumed: commands pass"])
    assert found.bend_deg > 2 * OPEN_DEG
    assert found.torque == 700


def test_a_client_may_close_the_hand_as_soon_as_it_has_opened_the_port():
    """Looks for a client are a tenth of a second apart."""
    with guarded_port() as port:
        t = port.line.clock.now()
        port.line.present = (t + 3.03, np.inf)
        port.line.script += [(t + 3.031 + 0.1 * step, FIST) for step in range(20)]
        assert port.run(5.0).state is PortState.PASSING
    assert [stop.violation.reason for stop in port.stops] == [SafetyReason.ENDED]


HEALTHY_S = float(os.environ.get("PORT_GUARD_S", "40"))


@pytest.mark.parametrize("firmware", ["0.2.0", pytest.param("0.1.0", marks=pytest.mark.slow)])
def test_a_healthy_client_is_not_stopped_and_its_bytes_are_not_changed(firmware):
    """The SDK's example again and again, with readings ten times a second; `PORT_GUARD_S` sets the hand time."""
    frames = sdk_frames()
    with guarded_port(firmware=firmware) as port:
        t, sent, asked = port.line.clock.now(), [], []
        for step in range(round(HEALTHY_S * 100)):
            frame = frames[step % len(frames)]
            sent.append(frame)
            query = make_query(READINGS[step // 10 % 4]) if step % 10 == 0 else b""
            asked += [query[0]] if query else []
            port.line.script.append((t + step * 0.01, frame + query))
        passed = []
        port.guard.listeners.append(lambda to_hand, data: passed.append(data) if to_hand else None)
        found = port.run(HEALTHY_S + 1.0)
    assert (found.state, port.stops, port.guard.refused) == (PortState.PASSING, [], 0)
    assert [frame for frame in passed if frame[0] not in READINGS] == sent
    replies = bytes(port.line.received)
    assert [replies[i] for i in range(0, len(replies), FRAME_SIZE)] == asked


def test_no_command_of_a_client_enters_a_region_and_one_command_goes_round_it():
    """The region is where another owner's thumb binds."""
    region = Region.of({"thumb_abduction": {"below": 0.6}, "thumb_cmc_flexion": {"below": 0.3}})

    def pose(abduction, flexion):
        return np.rint(np.array([0.0] * 4 + [abduction, flexion, 0.0]) * MAX_CODE).astype(int)

    with guarded_port(thresholds=Thresholds(forbidden=(region,))) as port:
        t = port.line.clock.now()
        goals = [(0.9, 0.05), (0.0, 0.0), (0.2, 0.5), (0.0, 0.0), (0.9, 0.05), (0.1, 0.5)]
        port.line.script += [(t + 1.0 + number, make_positions(pose(*goal))) for number, goal in enumerate(goals)]
        port.line.script.append((t + 8.0, make_torques([500] * 7)))
        port.line.present = (0.0, t + 9.0)
        readings = []
        port.guard.listeners.append(
            lambda to_hand, data: None if to_hand or data[0] != Opcode.GET_POS else readings.append(data)
        )
        found = port.run(20.0)
    shares = [unsigned_values(parse_reply(data)) / MAX_CODE for data in readings]
    inside = [region.holds(one) for one in shares]
    assert not any(inside[inside.index(False) :])
    assert any(abs(one[4] - 0.1) < 0.04 and abs(one[5] - 0.5) < 0.04 for one in shares)
    assert [stop.violation.reason for stop in port.stops] == [SafetyReason.CLIENT_ENDED]
    assert (found.state, port.guard.refused) == (PortState.REFUSING, 1)


class Chunks:
    """Line of which a test delivers the pieces."""

    def __init__(self):
        self.pieces, self.client, self.hand = [], bytearray(), bytearray()

    def wait(self, _longest_s):
        return self.pieces.pop(0) if self.pieces else (b"", b"")

    def to_port(self, data):
        self.hand += data

    def to_client(self, data):
        self.client += data


class Still:
    def now(self):
        return 0.0


def cut(data, places):
    ends = sorted({min(place, len(data)) for place in places} | {0, len(data)})
    return [data[begin:end] for begin, end in itertools.pairwise(ends)]


@settings(max_examples=200)
@given(
    users=st.lists(st.tuples(st.booleans(), st.sampled_from(READINGS)), max_size=12),
    text=st.sampled_from([b"", b"[BOOT] Hand Type: RIGHT_HAND\r\n"]),
    at=st.integers(0, 12),
    places=st.lists(st.integers(0, 250), max_size=20),
)
def test_each_reply_reaches_the_one_who_asked(users, text, at, places):
    """Replies come in the order of the requests, in any pieces, with boot text between two of them."""
    line = Chunks()
    port = SharedPort(line, Still(), "x", lambda frame: frame)
    answers, client, ours, asked = b"", bytearray(), bytearray(), b""
    for number, (is_ours, opcode) in enumerate(users):
        query = make_query(opcode)
        asked += query
        if number == at:
            answers, client, ours = answers + text, client + text, ours + text
        reply = bytes([opcode, 0]) + bytes([0x41 + number] * 14)
        answers += reply
        (ours if is_ours else client).extend(reply)
        if is_ours:
            port.guards_end.write(query)
        else:
            line.pieces += [(piece, b"") for piece in cut(query, places)]
            while line.pieces:
                port.pump(0.0)
    assert bytes(line.hand) == asked
    line.pieces = [(b"", piece) for piece in cut(answers, places)]
    while line.pieces:
        port.pump(0.0)
    assert (bytes(line.client), port.guards_end.read(4096, 0.0)) == (bytes(client), bytes(ours))
