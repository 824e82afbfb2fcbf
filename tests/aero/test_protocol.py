import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero import protocol
from aero.channels import Channel
from aero.protocol import Opcode, ReplyScanner

CODES = st.lists(st.integers(0, 65535), min_size=7, max_size=7)
GETS = st.sampled_from([Opcode.GET_POS, Opcode.GET_VEL, Opcode.GET_CURR, Opcode.GET_TEMP])


def frame(text):
    return bytes.fromhex(text).ljust(16, b"\0")


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (protocol.make_query(Opcode.HOMING), "01"),
        (protocol.make_query(Opcode.GET_POS), "22"),
        (protocol.make_query(Opcode.GET_VEL), "23"),
        (protocol.make_query(Opcode.GET_CURR), "24"),
        (protocol.make_query(Opcode.GET_TEMP), "25"),
        (
            # index, middle, ring, pinky, abduction, CMC, flexor; the thumb comes first on the wire.
            protocol.make_positions([0x0301, 0x0302, 0x0303, 0x0304, 0x0105, 0x0106, 0x0107]),
            "11 00 05 01 06 01 07 01 01 03 02 03 03 03 04 03",
        ),
        # What aero-open-sdk 0.1.0.dev1 sends for sixteen joints at zero.
        (protocol.make_positions([0, 0, 0, 0, 0, 0, 3815]), "11 00 00 00 00 00 E7 0E"),
        (protocol.make_torques([4, 5, 6, 7, 1, 2, 1000]), "12 00 01 00 02 00 E8 03 04 00 05 00 06 00 07 00"),
        (protocol.make_trim(Channel.INDEX, -100), "03 00 03 00 9C FF"),
        (protocol.make_trim(Channel.THUMB_FLEXOR, 10), "03 00 02 00 0A 00"),
        (protocol.make_set_speed(Channel.THUMB_ABDUCTION, 32766), "31 00 00 00 FE 7F"),
        (protocol.make_set_torque(Channel.PINKY, 1023), "32 00 06 00 FF 03"),
        (protocol.make_set_id(3, 1023), "02 00 03 00 FF 03"),
    ],
)
def test_golden_frames(made, expected):
    assert made == frame(expected)


def test_replies_are_taken_apart_into_command_order():
    positions = protocol.parse_reply(frame("22 00 05 01 06 01 07 01 01 03 02 03 03 03 04 03"))
    assert positions.opcode == Opcode.GET_POS
    expected = [0x0301, 0x0302, 0x0303, 0x0304, 0x0105, 0x0106, 0x0107]
    np.testing.assert_array_equal(protocol.unsigned_values(positions), expected)


def test_currents_and_speeds_are_twos_complement():
    reply = protocol.parse_reply(frame("24 00 FF FF 00 80 FF 7F"))
    np.testing.assert_array_equal(protocol.signed_values(reply), [0, 0, 0, 0, -1, -32768, 32767])


@given(CODES)
def test_what_is_packed_in_command_order_comes_back_in_command_order(codes):
    assert protocol.unsigned_values(protocol.parse_reply(protocol.make_positions(codes))).tolist() == codes


@given(CODES, st.binary(max_size=40), st.lists(st.integers(1, 20), max_size=20), GETS)
def test_the_reply_is_found_after_any_noise_in_any_pieces(codes, noise, cuts, opcode):
    reply = bytes([opcode, 0]) + protocol.make_positions(codes)[2:]
    noise = noise.replace(bytes([opcode]), b"")
    stream = noise + reply
    scanner, found = ReplyScanner(opcode), None
    for size in [*cuts, len(stream)]:
        found = scanner.feed(stream[:size])
        stream = stream[size:]
    assert found == protocol.parse_reply(reply)
    assert scanner.stray == noise


@given(st.binary(max_size=60), st.binary(min_size=14, max_size=14), st.integers(0, 15), GETS)
def test_never_more_is_asked_for_than_the_reply_still_lacks(noise, payload, arrived, opcode):
    scanner = ReplyScanner(opcode)
    scanner.feed(noise + (bytes([opcode, 0]) + payload)[:arrived])
    assert 1 <= scanner.missing <= 16 - arrived


def test_boot_text_never_passes_for_a_reply(boot_text):
    for opcode in Opcode:
        scanner = ReplyScanner(opcode)
        assert scanner.feed(boot_text) is None
        assert scanner.feed(bytes([opcode]) + b"\0" * 15) is not None
        assert scanner.stray == boot_text


@pytest.mark.parametrize(
    "printed",
    [
        b"ESP-ROM:esp32s3-20210327\r\nBuild:Mar 27 2021\r\nrst:0x1 (POWERON),boot:0x8\r\n",
        b"[BOOT] Hand Type: LEFT_HAND\r\n",
        "[BOOT] Power-on detected \u2192 homing\r\n".encode(),
        b"\n[Init] Pinging servos...\r\n",
        b"  ID 0: OK\r\n  ID 1: NO REPLY\r\n",
        b"Servo 0 dir=-1\nServo 1 dir=1\n",
    ],
)
def test_every_part_of_the_boot_text_is_known(printed):
    """As the chip's ROM and firmwares pre to 0.2.0 print it."""
    assert protocol.holds_boot_text(printed)
    assert not protocol.holds_boot_text(bytes(range(16)))


def test_replies_are_taken_one_after_the_other():
    """A value that looks like the start of a reply is not taken for one."""
    temperatures = bytes([Opcode.GET_TEMP, 0]) + bytes([Opcode.GET_VEL, 0]) * 7
    speeds = bytes([Opcode.GET_VEL, 0, *[1] * 14])
    scanner = ReplyScanner(Opcode.GET_TEMP, Opcode.GET_VEL)
    assert scanner.feed(temperatures + speeds) == protocol.parse_reply(temperatures)
    assert scanner.stray == speeds
