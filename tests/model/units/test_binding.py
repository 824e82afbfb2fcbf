"""A second owner's thumb that binds: his five currents, and a guard that meets it."""

import numpy as np
import pytest

from aero.channels import Channel
from aero.safety import SafetyStopError
from hil.emulated.any_hand import open_target

ABDUCTION, FLEXION = Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION


@pytest.fixture
def target():
    with open_target("emulated", unit="binding") as opened:
        yield opened


def current_ma(target, abduction, flexion):
    """Return abduction's current after a second at these shares of the windows, mA; positive closes."""
    codes = np.zeros(7, int)
    codes[ABDUCTION], codes[FLEXION] = round(65535 * abduction), round(65535 * flexion)
    target.hand.command_codes(codes)
    target.clock.sleep_until(target.clock.now() + 1.0)
    return 1e3 * np.mean([target.hand.read_currents()[ABDUCTION] for _ in range(8)])


def test_the_five_currents_of_the_second_owner_within_a_factor_of_two(target):
    """Jindongleee/aero-hand-mediapipe-teleop 6e7f9ab, config.py; abduction at 0.48 is assumed for the last two."""
    current_ma(target, 0.9, 0.05)
    assert abs(current_ma(target, 0.68, 0.05)) < 100
    for abduction, flexion, read_ma in ((0.60, 0.05, -500), (0.48, 0.05, -3126)):
        assert 0.5 <= current_ma(target, abduction, flexion) / read_ma <= 2.0
    current_ma(target, 0.48, 0.30)  # from flexion, as the owner
    for flexion, read_ma in ((0.17, -572), (0.145, -1703)):
        assert 0.5 <= current_ma(target, 0.48, flexion) / read_ma <= 2.0


def test_with_more_flexion_the_thumb_is_free_as_on_any_hand(target):
    """The owner reads 0 mA there; an emulated healthy hand 0.2 A, because the CMC cable pulls."""
    current_ma(target, 0.9, 0.30)
    assert abs(current_ma(target, 0.20, 0.30)) < 300


def test_the_guard_does_not_move_a_thumb_that_holds_against_its_palm():
    with open_target("emulated", unit="binding", guarded=True) as guarded:
        guarded.hand.clock.sleep_until(guarded.hand.clock.now() + 0.5)
        with pytest.raises(SafetyStopError, match="thumb_abduction draws"):
            guarded.begin()
