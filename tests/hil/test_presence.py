"""A hand is there, and what it reports can be true."""

import numpy as np
import pytest
from quantities import assert_between

pytestmark = pytest.mark.presence


def test_seven_servos_report_plausible_temperatures(hand):
    temperatures = hand.read_temperatures()
    assert temperatures.shape == (7,), f"temperatures have shape {temperatures.shape}, should be (7,)"
    assert_between("temperature", temperatures, 10, 65, "°C")


def test_an_open_hand_at_rest_reads_open_and_still(hand):
    assert_between("position of the open hand", hand.read_codes(), 0, 0.03 * 65535)
    assert_between("speed of the resting shaft", hand.read_speeds(), -0.2, 0.2, "rad/s")


def test_an_open_hand_at_rest_draws_little(hand):
    # 0-500 mA a channel at the open pose on one physical hand, public logs June-July 2026 (TTdragoAlex/
    # tetherIA-aero-hand-open 58b518e); 250-290 mA of it stay on CMC flexion with firmware 0.2.0 whatever is commanded.
    assert_between("current of the open hand", hand.read_currents(), -0.6, 0.6, "A")


def test_readings_follow_each_other_quickly(target, hand):
    """The median counts, so that a machine which stands still for a moment does not."""
    took = []
    for _ in range(20):
        start = target.clock.now()
        hand.read_codes()
        took.append(target.clock.now() - start)
    assert np.median(took) < 0.05, f"a reading takes {1e3 * np.median(took):.0f} ms, should take less than 50 ms"


def test_each_reading_is_asked_of_the_board(target, hand):
    """A driver that returns an earlier reading hides a motion."""
    for name in ("codes", "speeds", "currents", "temperatures"):
        for _ in range(3):
            mark = target.wire.mark()
            getattr(hand, f"read_{name}")()
            assert target.wire.since(mark, 0.0), f"the driver returned {name} without a request to the board"
