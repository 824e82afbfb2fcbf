"""Channels beside each other, on readings made by hand."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.checks.alike.check import measure
from tests.support.synthetic import LABELS


def rows(metric, **values):
    return {label: {metric: value} for label, value in values.items()}


def test_each_servo_stands_beside_the_median_of_the_others():
    warm = dict.fromkeys(LABELS, 30.0) | {"ring": 45.0}
    found = measure({"presence": rows("temperature", **warm)})
    assert found["ring"] == {"temperature": 15.0}
    assert found["index"] == {"temperature": 0.0}


def test_what_most_others_lack_is_left_out():
    warm = {"index": 50.0, "ring": float("nan")}
    assert measure({"presence": rows("temperature", **warm)})["index"] == {}


RATES = st.floats(0.1, 10.0)


def rates(first, last):
    return {"response": {"hand": {"open_close_rate": first}}, "drift": {"hand": {"open_close_rate": last}}}


@given(RATES, RATES)
def test_the_change_of_pace_is_that_of_the_rate(first, last):
    assert measure(rates(first, last))["hand"]["pace_change"] == pytest.approx(100.0 * (last - first) / first)


@pytest.mark.parametrize("name", ["response", "drift"])
def test_a_pace_that_was_not_measured_has_not_changed(name):
    unmeasured = rates(1.0, 1.0) | {name: {"hand": {"open_close_rate": float("nan")}}}
    assert "hand" not in measure(unmeasured)
    assert "hand" not in measure({name: rates(1.0, 1.0)[name]})
