import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_emulator.packets import Packet, PacketParser, pack

SERVO_IDS = st.integers(0, 0xFE)
PACKETS = st.builds(pack, SERVO_IDS, st.integers(0, 0xFF), st.binary(max_size=64))

GOLDEN = [
    ((0, 0x01, b""), "FF FF 00 02 01 FC"),
    ((0, 0x00, b""), "FF FF 00 02 00 FD"),
    ((0, 0x03, bytes((33, 0))), "FF FF 00 04 03 21 00 D7"),
    ((3, 0x03, bytes.fromhex("2C E8 03")), "FF FF 03 05 03 2C E8 03 DD"),
    ((0, 0x0B, b""), "FF FF 00 02 0B F2"),
    ((0xFE, 0x82, bytes((56, 15, *range(7)))), "FF FF FE 0B 82 38 0F 00 01 02 03 04 05 06 18"),
]


@pytest.mark.parametrize(("fields", "data"), GOLDEN)
def test_golden_packets(fields, data):
    assert pack(*fields) == bytes.fromhex(data)
    assert PacketParser().feed(bytes.fromhex(data)) == [(len(bytes.fromhex(data)), Packet(*fields))]


@given(st.lists(PACKETS, max_size=6), st.data())
def test_packets_survive_any_chopping_of_the_stream(packets, data):
    stream = b"".join(packets)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    parser = PacketParser()
    found, ends = [], []
    for begin, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        for at, packet in parser.feed(stream[begin:end]):
            found.append(pack(*packet))
            ends.append(begin + at)
    assert found == packets
    assert ends == [len(b"".join(packets[: number + 1])) for number in range(len(packets))]


@given(PACKETS, st.integers(2, 200), st.integers(1, 255))
def test_a_damaged_packet_is_never_taken_for_what_it_was(packet, at, flip):
    at = min(at, len(packet) - 1)
    damaged = bytearray(packet)
    damaged[at] ^= flip
    parser = PacketParser()
    assert all(pack(*found) != packet for _, found in parser.feed(bytes(damaged)))


@given(st.lists(st.binary(max_size=300), max_size=20))
def test_garbage_does_not_pile_up(chunks):
    parser = PacketParser()
    for chunk in chunks:
        parser.feed(chunk)
        assert len(parser._pending) <= 4 + 255


def test_a_packet_behind_garbage_and_a_third_header_byte_is_found():
    parser = PacketParser()
    found = parser.feed(b"\x00\xff\x12\xff" + pack(1, 1))
    assert [packet for _, packet in found] == [Packet(1, 1, b"")]
