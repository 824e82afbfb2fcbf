"""Intervals hold the truth as often as they say: on linear models with noise, where everything is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from train.identification.search import NOISE_COUNTS, solved
from train.identification.uncertainty import (
    COVERAGE_SIGMA,
    covariance,
    factors_of,
    interval_factors,
    intervals,
    told,
    widened,
)
from train.identification.unit_parameters import FREE

SPREAD = np.array([1.0, 0.7, 0.3])


def noise(draw, together):
    """Residuals of two counts, each as alike to the one before as `together` says."""
    own = draw.normal(size=(400, 7)) * 2.0
    for i in range(1, len(own)):
        own[i] = together * own[i - 1] + np.sqrt(1.0 - together**2) * own[i]
    return own


@pytest.mark.parametrize("together", [0.0, 0.8])
@pytest.mark.parametrize("hidden_spread", [0.0, 0.5])
def test_intervals_hold_the_truth_as_often_as_they_say(together, hidden_spread):
    """With noise that goes together in time, and a kept number that is not what it is believed to be."""
    draw = np.random.default_rng(5)
    slope, felt = draw.normal(size=(400, 7, 3)), draw.normal(size=(400, 7, 1))
    felt[..., 0] += slope[..., 0]  # the kept number hides behind the first one
    inside = []
    for _ in range(200):
        truth, kept = draw.normal(size=3) * SPREAD, draw.normal(size=1) * hidden_spread
        residual = noise(draw, together) - slope @ truth - felt @ kept
        x = solved(lambda x, r=residual: [r + slope @ x], [slope], np.zeros(3), SPREAD, NOISE_COUNTS)
        missed = residual + slope @ x
        errors = covariance([missed], [slope], SPREAD, [felt], np.array([hidden_spread]))
        low, high = intervals(lambda x: {"take_up": x}, x, errors)["take_up"]
        inside.append((low <= truth) & (truth <= high))
    assert np.mean(inside) > 0.9
    assert np.mean(high - low) < 4.0 * np.mean(2 * COVERAGE_SIGMA * SPREAD)


def test_a_number_that_the_readings_do_not_feel_is_known_as_before():
    zero = np.zeros((50, 7, 3))
    errors = covariance([np.zeros((50, 7))], [zero], SPREAD, [zero], SPREAD)
    assert errors == pytest.approx(np.diag(SPREAD**2))


def test_a_factor_has_an_interval_that_keeps_its_sign():
    low, high = intervals(lambda x: {"gain": np.exp(x)}, np.zeros(1), np.eye(1))["gain"]
    assert low[0] == pytest.approx(np.exp(-COVERAGE_SIGMA * np.sinh(1.0)))
    assert low[0] * high[0] == pytest.approx(1.0)


def test_an_entry_that_was_not_fitted_has_no_width():
    low, high = intervals(lambda x: {"gain": np.array([x[0], 0.3])}, np.ones(1), np.eye(1))["gain"]
    assert low[1] == high[1] == 0.3
    assert low[0] < 1.0 < high[0]


def test_what_readings_tell_is_narrower_than_what_was_believed():
    believed = intervals(lambda x: {"take_up": x}, np.zeros(2), np.eye(2))
    known = intervals(lambda x: {"take_up": x}, np.zeros(2), np.diag([0.7, 0.9]) ** 2)
    assert told(known, believed)["take_up"].tolist() == [True, False]


@given(st.floats(1.0, 50.0), st.floats(1.0, 50.0))
def test_widths_grow_by_the_factor_up_to_what_is_believed_anyway(first, second):
    errors, spread = np.array([[0.01, 0.004], [0.004, 0.04]]), np.array([0.7, 0.3])
    wider = widened(errors, np.array([first, second]), spread)
    deviation = np.sqrt(np.diag(wider))
    assert deviation == pytest.approx([min(0.1 * first, 0.7), min(0.2 * second, 0.3)])
    correlation = wider[0, 1] / np.prod(deviation)
    assert correlation == pytest.approx(0.2)


def test_a_factor_is_that_of_the_kind_else_of_the_section():
    found = factors_of(FREE, {"servos": 2.0, "hand": 3.0, "hand.spring_closed": 5.0})
    for number, factor in zip(FREE, found, strict=True):
        rise = number.name == "hand.spring_rise"
        assert factor == (5.0 if rise else 2.0 if number.name.startswith("servos") else 3.0)


def test_every_number_that_is_fitted_has_a_shipped_factor():
    assert np.all(factors_of(FREE, interval_factors()) >= 1.0)
