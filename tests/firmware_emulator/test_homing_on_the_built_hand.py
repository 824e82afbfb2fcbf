"""Homing against the end stops of the built hand, every unit that is shipped."""

import pytest

from model import BuiltHandPlant
from model.units import load_unit, shipped_units
from tests.firmware_emulator.conftest import frame


def homing_time(make_host, unit, hand, firmware):
    """Time of one homing on the hand's clock, s."""
    loaded = load_unit(unit)
    host = make_host(plant=BuiltHandPlant(loaded.hand, side=hand), servos=loaded.servos, side=hand, firmware=firmware)
    start = host.hand.clock.now()
    assert host.ask(0x01, timeout=200.0) == frame("01")
    return host.hand.clock.now() - start


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("unit", shipped_units())
def test_every_unit_meets_its_stops_in_four_seconds(make_host, unit, hand):
    assert 3.5 < homing_time(make_host, unit, hand, "0.2.0") < 4.6


@pytest.mark.slow
def test_the_slow_homing_of_0_1_0_takes_about_a_minute(make_host):
    assert 50 < homing_time(make_host, "reference", "right", "0.1.0") < 60
