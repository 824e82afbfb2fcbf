"""Channels beside each other, on readings made by hand."""

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
