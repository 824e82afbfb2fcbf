import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hil.lab.map_identification.captures import Capture
from hil.lab.map_identification.regression import DESIGNS, least_squares, regressors

NUMBERS = st.floats(-100.0, 100.0)


def capture_of(seed, n=60):
    rng = np.random.default_rng(seed)
    lengths = np.zeros((n, 7))
    lengths[:, 4:] = rng.uniform([0, 0.027, 0.084], [1.7, 0.038, 0.110], (n, 3))
    return Capture(lengths, np.zeros((n, 16)), np.repeat(np.arange(6), n // 6))


@given(st.sampled_from(sorted(DESIGNS)), st.integers(0, 99), st.data())
def test_what_is_linear_in_the_regressors_is_recovered(design, seed, data):
    capture = capture_of(seed)
    x = regressors(design, capture)
    planted = data.draw(arrays(np.float64, (2, x.shape[1]), elements=NUMBERS))
    planted[:, 0] += 200.0
    fit = least_squares(x, x @ planted.T, capture.sweep)
    np.testing.assert_allclose(x @ fit.coefficients.T, x @ planted.T, atol=1e-8)
    assert np.abs(fit.residuals).max() < 1e-8


def test_r_squared_is_the_share_of_the_spread_that_is_explained():
    capture = capture_of(1)
    noise = np.random.default_rng(2).normal(size=(60, 1))
    x = np.column_stack([capture.lengths[:, 4], np.ones(60)])
    fit = least_squares(x, 3.0 * x[:, :1] + noise, capture.sweep)
    expected = np.corrcoef(x[:, 0], (3.0 * x[:, :1] + noise)[:, 0])[0, 1] ** 2
    assert fit.r_squared[0] == pytest.approx(expected)


def test_standard_errors_hold_when_errors_go_together_within_a_sweep():
    """Over many draws, the spread of the estimates is what the standard errors say."""
    rng = np.random.default_rng(3)
    sweep = np.repeat(np.arange(40), 10)
    x = np.column_stack([np.repeat(rng.uniform(-1, 1, 40), 10), np.ones(400)])
    estimates, errors = [], []
    for _ in range(300):
        shared = np.repeat(rng.normal(size=40), 10) + 0.1 * rng.normal(size=400)
        fit = least_squares(x, (2.0 * x[:, 0] + shared)[:, np.newaxis], sweep)
        estimates.append(fit.coefficients[0, 0])
        errors.append(fit.standard_errors[0, 0])
    assert np.mean(errors) == pytest.approx(np.std(estimates), rel=0.1)


def test_with_a_constant_alone_it_is_the_standard_error_of_the_sweeps_means():
    means = np.array([1.0, 2.0, 4.0])
    fit = least_squares(np.ones((30, 1)), np.repeat(means, 10)[:, np.newaxis], np.repeat(np.arange(3), 10))
    assert fit.standard_errors[0, 0] == pytest.approx(means.std(ddof=1) / np.sqrt(3))


def test_a_channel_that_never_moved_is_no_basis_for_a_fit():
    capture = capture_of(4)
    capture.lengths[:, 5] = 0.03
    with pytest.raises(ValueError, match="not moved on its own"):
        least_squares(regressors("first order", capture), np.ones((60, 1)), capture.sweep)


def test_a_joint_that_never_moved_cannot_be_explained():
    capture = capture_of(6)
    with pytest.raises(ValueError, match="target 1 is constant"):
        least_squares(regressors("first order", capture), capture.lengths[:, [4, 0]], capture.sweep)


def test_abduction_is_left_out_where_it_was_held():
    capture = capture_of(5)
    assert regressors("first order", capture).shape == (60, 4)
    capture.lengths[:, 4] = 0.75
    assert regressors("first order", capture).shape == (60, 3)
