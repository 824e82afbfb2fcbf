from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aero.channels import Channel
from aero.policy.settings import PAPER_TRAINING
from model.units import load_unit
from model.units.cable_correction import correction

IDEAL = load_unit("ideal")
take_ups = st.lists(st.floats(-0.001, 0.006), min_size=6, max_size=6)


def test_the_ideal_hand_needs_no_correction():
    np.testing.assert_allclose(correction(IDEAL, PAPER_TRAINING), 0.0, atol=1e-9)


@given(take_ups)
@settings(max_examples=5)
def test_a_cable_that_is_too_long_is_wound_in_by_as_much(values):
    take_up = np.insert(values, Channel.THUMB_ABDUCTION, 0.0)
    unit = replace(IDEAL, hand=replace(IDEAL.hand, cable_take_up=tuple(take_up.tolist())))
    found = correction(unit, PAPER_TRAINING)
    np.testing.assert_allclose(found[:4], -take_up[:4], atol=0.2e-3)
    # Friction and stops of the thumb's joints leave some of it.
    np.testing.assert_allclose(found[5:], -take_up[5:], rtol=0.25, atol=0.5e-3)
    assert found[Channel.THUMB_ABDUCTION] == 0.0


def test_the_recorded_hands_thumb_is_let_out():
    found = correction(load_unit("reference"), PAPER_TRAINING)
    assert found[Channel.THUMB_CMC_FLEXION] == pytest.approx(3.2e-3, abs=0.5e-3)  # its cable is 5.2 mm short
    assert found[Channel.THUMB_FLEXOR] == pytest.approx(1.4e-3, abs=0.5e-3)
    assert found[Channel.THUMB_ABDUCTION] == 0.0
