"""Factors widen intervals as far as what is believed anyway, and every number has one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from train.identification.uncertainty import (
    factors_of,
    interval_factors,
    intervals,
    widened,
)
from train.identification.unit_parameters import FREE


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


def test_an_interval_of_a_widened_error_holds_what_it_is_off_by():
    errors = widened(np.eye(1) * 0.01, np.array([4.0]), np.array([9.0]))
    low, high = intervals(lambda x: {"take_up": x}, np.zeros(1), errors)["take_up"]
    assert (low[0], high[0]) == pytest.approx((-0.784, 0.784))
