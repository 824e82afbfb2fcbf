"""Which samples are settled, on recordings made by hand."""

import numpy as np

from hil.checks.staircase.tracking import residuals
from tests.support.synthetic import RANGES, replaced, staircase


def test_a_hand_that_shakes_is_not_settled():
    """It swings by 2 % of its range from sample to sample, under a quiet command."""
    recording = staircase()
    hand = recording["hand"].values.copy()
    hand[::2, 2] += 0.02 * RANGES[2]
    _, settled = residuals(replaced(recording, "hand", hand))
    assert not settled[1:, 2].any()
    assert settled[:, 1].any()


def test_a_simulator_that_shakes_is_not_settled():
    recording = staircase()
    simulated = recording["model"].values.copy()
    simulated[::2, 2] += 0.02 * RANGES[2]
    _, settled = residuals(replaced(recording, "model", simulated))
    assert not settled[1:, 2].any()
    assert settled[:, 1].any()


def test_a_residual_is_hand_less_simulator():
    recording = staircase(tau=0.02, hand_tau=0.02, offset=0.01)
    residual, _ = residuals(recording)
    np.testing.assert_allclose(residual, np.broadcast_to(0.01 * RANGES, residual.shape), atol=1e-12)
