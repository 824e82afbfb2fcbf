"""The swing of the thumb's current on a hand with a cube and on an empty one."""

from aero.policy.held import HELD_A
from train.held_currents import SEED, swings_a


def test_the_shipped_policy_is_detected_with_a_cube_and_not_without():
    assert (swings_a(SEED, empty=True) < HELD_A).all()
    assert (swings_a(SEED, empty=False) > HELD_A).any()
