"""Factors make intervals hold as often as they say, on what they were not computed from."""

import numpy as np
import pytest
from figures.intervals import conformal_factor, deviations
from hypothesis import given
from hypothesis import strategies as st

from train.identification.uncertainty import (
    COVERAGE_SIGMA,
    factors_of,
    interval_factors,
    intervals,
    widened,
)
from train.identification.unit_parameters import FREE


def test_a_factor_holds_numbers_that_it_was_not_computed_from():
    draw = np.random.default_rng(3)
    inside = []
    for _ in range(300):
        off = np.abs(draw.standard_t(2, size=41)) * 3.0
        factor = conformal_factor(off[:40])
        inside.append(off[40] <= factor * COVERAGE_SIGMA)
    assert 0.92 < np.mean(inside) < 0.98


def test_a_few_numbers_give_the_largest_they_need():
    assert conformal_factor([1.0, 9.8, 2.0]) == pytest.approx(9.8 / 1.96)


@given(st.lists(st.floats(0.0, 1.0), min_size=1))
def test_no_interval_becomes_narrower(off):
    assert conformal_factor(off) == 1.0


@given(st.floats(1.0, 50.0), st.floats(1.0, 50.0))
def test_widths_grow_by_the_factor_up_to_what_is_believed_anyway(first, second):
    errors, spread = np.array([[0.01, 0.004], [0.004, 0.04]]), np.array([0.7, 0.3])
    wider = widened(errors, np.array([first, second]), spread)
    deviation = np.sqrt(np.diag(wider))
    assert deviation == pytest.approx([min(0.1 * first, 0.7), min(0.2 * second, 0.3)])
    correlation = wider[0, 1] / np.prod(deviation)
    assert correlation == pytest.approx(0.2)


def test_deviations_are_those_that_the_interval_counts_in():
    values = {"hand.gain": np.array([1.0, 5.0]), "hand.cable_take_up": np.array([1.0, 2.0])}
    known = {
        "hand.gain": (np.exp([-0.196, 0.0]) * values["hand.gain"], np.exp([0.196, 0.0]) * values["hand.gain"]),
        "hand.cable_take_up": (values["hand.cable_take_up"] - 1.96, values["hand.cable_take_up"] + 1.96),
    }
    truth = {"hand.gain": np.exp([0.3, 0.3]), "hand.cable_take_up": np.array([1.5, 0.0])}
    off = deviations(values, truth, known)
    assert off["hand.gain"] == pytest.approx([3.0])
    assert off["hand.cable_take_up"] == pytest.approx([0.5, 2.0])


def test_a_factor_is_that_of_the_kind_else_of_the_section():
    found = factors_of(FREE, {"servos": 2.0, "hand": 3.0, "hand.spring_closed": 5.0})
    for number, factor in zip(FREE, found, strict=True):
        rise = number.name == "hand.spring_rise"
        assert factor == (5.0 if rise else 2.0 if number.name.startswith("servos") else 3.0)


def test_every_number_that_is_fitted_has_a_shipped_factor():
    assert np.all(factors_of(FREE, interval_factors()) >= 1.0)


def test_an_interval_of_a_widened_error_holds_what_it_is_off_by():
    errors = widened(np.eye(1) * 0.01, np.array([4.0]), np.array([9.0]))
    low, high = intervals(lambda x: {"take_up": x}, np.zeros(1), errors)["take_up"]
    assert (low[0], high[0]) == pytest.approx((-0.784, 0.784))
