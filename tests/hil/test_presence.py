"""A hand is there, and what it reports can be true."""

import numpy as np
import pytest

pytestmark = pytest.mark.presence


def test_seven_servos_report_plausible_temperatures(hand):
    temperatures = hand.read_temperatures()
    assert temperatures.shape == (7,)
    assert np.all((temperatures >= 10) & (temperatures <= 65))


def test_an_open_hand_at_rest_reads_open_and_still(hand):
    assert np.all(hand.read_codes() < 0.03 * 65535)
    assert np.all(np.abs(hand.read_speeds()) < 0.2)


def test_an_open_hand_at_rest_draws_little(hand):
    # 0-500 mA a channel at the open pose on one physical hand, public logs June-July 2026 (TTdragoAlex/
    # tetherIA-aero-hand-open 58b518e); 250-290 mA of it stay on CMC flexion with firmware 0.2.0 whatever is commanded.
    assert np.all(np.abs(hand.read_currents()) < 0.6)


def test_readings_follow_each_other_quickly(target, hand):
    """The median counts, so that a machine which stands still for a moment does not."""
    took = []
    for _ in range(20):
        start = target.clock.now()
        hand.read_codes()
        took.append(target.clock.now() - start)
    assert np.median(took) < 0.05
