"""Homing against the end stops of the built hand, every unit that is shipped."""

import time

import pytest

from model import BuiltHandPlant
from model.units import load_unit, shipped_units
from tests.firmware_emulator.conftest import frame


def homing_times(make_host, unit, hand, firmware):
    """Time that one homing takes, s: on the hand's clock, and of the processor."""
    loaded = load_unit(unit)
    host = make_host(plant=BuiltHandPlant(loaded.hand, hand=hand), servos=loaded.servos, hand=hand, firmware=firmware)
    began, start = time.process_time(), host.hand.clock.now()
    assert host.ask(0x01, timeout=200.0) == frame("01")
    return host.hand.clock.now() - start, time.process_time() - began


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("unit", shipped_units())
def test_every_unit_meets_its_stops_in_four_seconds(make_host, unit, hand):
    taken, _ = homing_times(make_host, unit, hand, "0.2.0")
    assert 3.5 < taken < 4.6


@pytest.mark.slow
def test_every_packet_of_the_slow_homing_ten_times_faster_than_real_time(make_host):
    taken, processor = homing_times(make_host, "reference", "right", "0.1.0")
    assert 50 < taken < 60
    assert processor < taken / 10
