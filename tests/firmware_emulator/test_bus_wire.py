"""The servo bus as a wire: baud rates, a second ID, masters that take turns; and other models of servo."""

from dataclasses import replace

import pytest

from firmware_emulator.bench import Bench, BenchShaft
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.packets import pack
from firmware_emulator.servo.parameters import HLS3606M

PING, READ, WRITE, SYNC_WRITE = 1, 2, 3, 0x83
RATES = (1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400)
"""Transcribed HLS memory table, register 6."""


class Wire:
    """A bare hand, and masters on its bus."""

    def __init__(self, **options):
        self.hand = EmulatedHand(Bench(BenchShaft(friction=0.0)), start="bare", **options)
        self.bus = self.hand.bus
        self.heard = []
        self.port = self.master()

    def master(self):
        heard = bytearray()
        self.heard.append(heard)
        return self.bus.connect(heard.extend)

    def wait(self, seconds=0.02):
        self.hand.clock.sleep_until(self.hand.clock.now() + seconds)

    def ask(self, servo, code, parameters=b""):
        self.heard[0].clear()
        self.port.write(pack(servo, code, parameters))
        self.wait()
        return bytes(self.heard[0])


def test_a_servo_answers_at_its_own_baud_rate_only():
    wire = Wire()
    for number, rate in enumerate(RATES):
        wire.port.baud = RATES[number - 1] if number else rate
        assert wire.ask(3, WRITE, bytes((6, number))) == pack(3, 0)
        for other in (*RATES, 4800, 9600, 19200, 921600):
            wire.port.baud = other
            assert wire.ask(3, PING) == (pack(3, 0) if other == rate else b"")
            assert wire.ask(2, PING) == (pack(2, 0) if other == RATES[0] else b"")


def test_a_byte_takes_ten_bits_at_the_masters_rate():
    wire = Wire()
    arrived = []
    port = wire.bus.connect(lambda data: arrived.append(wire.hand.clock.now()))
    wire.ask(3, WRITE, bytes((6, 7)))
    port.baud = 38_400
    start = wire.hand.clock.now()
    port.write(pack(3, PING))
    wire.wait()
    assert arrived == [pytest.approx(start + 12 * 10 / 38_400 + 100e-6, abs=1e-9)]


def test_a_baud_rate_that_was_not_kept_is_forgotten_with_the_power():
    wire = Wire()
    wire.ask(3, WRITE, bytes((6, 1)))
    assert wire.ask(3, PING) == b""
    wire.hand.servos[3].power_up()
    assert wire.ask(3, PING) == pack(3, 0)


def test_a_secondary_id_takes_writes_and_answers_nothing():
    """Transcribed HLS memory table, register 7: write commands only."""
    wire = Wire()
    wire.ask(3, WRITE, bytes((7, 77)))
    wire.ask(4, WRITE, bytes((7, 77)))
    assert wire.ask(77, PING) == wire.ask(77, READ, bytes((41, 1))) == b""
    assert wire.ask(77, WRITE, bytes((41, 9))) == b""
    assert [servo.memory.get("acceleration") for servo in wire.hand.servos] == [0, 0, 0, 9, 9, 0, 0]
    wire.port.write(pack(0xFE, SYNC_WRITE, bytes((41, 1, 77, 5, 1, 6))))
    wire.wait()
    assert [servo.memory.get("acceleration") for servo in wire.hand.servos] == [0, 6, 0, 5, 5, 0, 0]


def test_masters_wait_for_each_other():
    wire = Wire()
    other = wire.master()
    wire.port.write(pack(3, PING))
    other.write(pack(4, PING))
    wire.wait()
    assert wire.heard == [pack(3, 0), pack(4, 0)]


def test_an_sts3215_is_one_by_its_numbers_and_its_offset():
    """Model number 777 and sign bit 11 of the offset as LeRobot 0.4.4 has them."""
    wire = Wire(servos=replace(HLS3606M, model="STS3215"))
    assert wire.ask(3, READ, bytes((3, 2)))[5:7] == (777).to_bytes(2, "little")
    wire.ask(3, WRITE, bytes((31, *(1000 | 1 << 11).to_bytes(2, "little"))))
    assert wire.hand.servos[3].memory.get("offset") == -1000
    assert wire.hand.servos[3].frame.offset == -1000
    # Register 7 is a delay there, and no second ID.
    wire.ask(3, WRITE, bytes((7, 77)))
    wire.ask(77, WRITE, bytes((41, 9)))
    assert wire.hand.servos[3].memory.get("acceleration") == 0
