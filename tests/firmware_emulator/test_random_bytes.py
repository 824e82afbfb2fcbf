"""A million random bytes at either interface: nothing breaks or grows, and the device ends as a real one would."""

import random

from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from tests.firmware_emulator.conftest import stopped_bench

MILLION = 1_000_000
GET_TEMP = b"\x25".ljust(16, b"\0")


def test_the_board_ends_exactly_as_misaligned_as_the_bytes_it_took(make_host):
    rng = random.Random(0)
    host = make_host(plant=stopped_bench())
    board = host.hand.board
    for _ in range(MILLION // 500):
        data = rng.randbytes(500)
        host.hand.receive(data)
        assert len(board._queue) <= 256
        host.wait(0.01)
        host.link.discard_input()
    assert len(host.hand.kernel._queue) < 1000
    # Whatever homing it was told to do has come to its end when nothing more is taken from the queue.
    host.wait(60.0)
    host.link.discard_input()
    stuck = len(board._queue)
    assert stuck < 16
    host.link.write(GET_TEMP)
    if stuck:
        assert host.link.read(16, 0.1)[:1] != b"\x25"
        host.link.write(b"\xa0" * (16 - stuck))
        host.link.read(64, 0.1)
    else:
        assert len(host.link.read(16, 0.1)) == 16
    assert host.ask(0x25)[:2] == b"\x25\0"


def test_servos_answer_again_after_the_bytes_and_a_silence():
    rng = random.Random(1)
    hand = EmulatedHand(Bench(), start="bare")
    hand.bus.servos = hand.servos[:3]
    answers = bytearray()
    port = hand.bus.connect(answers.extend)
    for number in range(MILLION // 1000):
        # Headers and likely IDs and lengths more often than chance would have it, in every other piece.
        alphabet = bytes(range(256)) if number % 2 else b"\xff\xff\xff\xfe\0\1\2\3\4\5\6\x0b\x82\x83"
        port.write(bytes(rng.choices(alphabet, k=1000)))
        hand.clock.sleep_until(hand.clock.now() + 0.02)
        assert len(port._parser._pending) < 260
        answers.clear()
    assert len(hand.kernel._queue) < 1000
    for servo in hand.servos:
        servo.restore()
    hand.clock.sleep_until(hand.clock.now() + 1.0)
    for servo in {servo.id for servo in hand.bus.servos}:
        port.write(bytes((255, 255, servo, 2, 1, ~(servo + 3) & 255)))
        hand.clock.sleep_until(hand.clock.now() + 0.01)
        assert bytes(answers) == bytes((255, 255, servo, 2, 0, ~(servo + 2) & 255))
        answers.clear()


def test_a_link_that_nobody_reads_keeps_what_came_and_the_board_only_its_first_and_last_bytes():
    hand = EmulatedHand(Bench())
    for _ in range(100):
        hand.receive(GET_TEMP)
        hand.clock.sleep_until(hand.clock.now() + 0.001)
    assert len(InProcessLink(hand).read(10_000, 0.0)) == 64 + 256
