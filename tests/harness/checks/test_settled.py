"""Which samples are settled, on recordings made by hand."""

import numpy as np
import pytest

from hil.checks.staircase.tracking import residuals
from tests.support.synthetic import RANGES, replaced, staircase


@pytest.mark.parametrize("shaking", ["hand", "model"])
def test_what_shakes_is_not_settled(shaking):
    """Hand or simulator swings by 2 % of its range from sample to sample, under a quiet command."""
    recording = staircase()
    values = recording[shaking].values.copy()
    values[::2, 2] += 0.02 * RANGES[2]
    _, settled = residuals(replaced(recording, shaking, values))
    assert not settled[1:, 2].any()
    assert settled[:, 1].any()


def test_a_residual_is_hand_less_simulator():
    recording = staircase(tau=0.02, hand_tau=0.02, offset=0.01)
    residual, _ = residuals(recording)
    np.testing.assert_allclose(residual, np.broadcast_to(0.01 * RANGES, residual.shape), atol=1e-12)
