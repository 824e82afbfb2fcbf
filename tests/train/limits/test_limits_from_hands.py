"""Limits follow from the readings of healthy hands, and hold all of them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import expon, uniform

from hil.checks.shared.declaration import Bound, parse_metric
from hil.verdict.limits import limits_text, parse_limits
from train.limits.compute import FEWEST, Healthy, computed_limits, upper_bound

CHECK = Bound("staircase", "take_up", ("index", "ring"), side="both")
COUNT_MM = 45.26 / 3278
"""One servo count of a finger's cable."""
VERSIONS = ("0.1.3", "0.1.4", "0.1.5")


def healthy(values):
    return Healthy(VERSIONS, {("staircase", "take_up", "index"): np.asarray(values, float)})


@given(st.lists(st.floats(-100, 100), min_size=FEWEST, max_size=100))
def test_a_limit_holds_every_healthy_reading_and_one_step_more(every):
    (limit,) = computed_limits([CHECK], [healthy(every)])
    # Limits are written with six figures.
    assert limit.at_least <= min(every) - COUNT_MM + 1e-4
    assert limit.at_most >= max(every) + COUNT_MM - 1e-4
    assert limit.firmware == VERSIONS


@given(st.lists(st.floats(-100, 100), min_size=FEWEST, max_size=100), st.floats(-1000, 1000))
def test_a_limit_moves_with_its_readings(values, shift):
    (one,) = computed_limits([CHECK], [healthy(values)])
    (other,) = computed_limits([CHECK], [healthy(np.array(values) + shift)])
    # Limits are rounded to three figures.
    assert other.at_most == pytest.approx(one.at_most + shift, abs=0.02 * (abs(shift) + abs(one.at_most) + 1))


@pytest.mark.parametrize(("law", "factor"), [(expon(), 1.35), (uniform(), 1.25)])
def test_a_far_quantile_is_met_by_its_tail(law, factor):
    chance = 1e-4
    found = [upper_bound(law.rvs(400, random_state=seed), chance) for seed in range(40)]
    # The median bound is the true quantile, give or take; a bounded law has nothing beyond its end.
    assert law.isf(chance) / factor < np.median(found) < law.isf(chance) * factor


def test_a_table_of_limits_is_read_as_it_was_written():
    limits = computed_limits([CHECK], [healthy(np.arange(float(FEWEST)))])
    assert parse_limits(limits_text(limits)) == limits


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"colour": 1}, "unknown key"),
        ({"floor": 0.1}, "unknown key"),
        ({"at_most": 3.0, "source": "physics"}, "give a side, or"),
    ],
)
def test_a_mistake_in_a_check_is_named(changes, message):
    table = {"name": "spring", "unit": "A", "on": ["index"], "side": "both", "evidence": "torque"} | changes
    with pytest.raises(ValueError, match=f"check on spring: .*{message}"):
        list(parse_metric("staircase", {key: value for key, value in table.items() if value is not None}))


READINGS = st.lists(st.floats(-3, 3), min_size=FEWEST, max_size=100)


@given(READINGS, READINGS)
def test_a_limit_for_both_holds_what_each_needs(free, guarded):
    hands = [
        Healthy(VERSIONS, {("staircase", "take_up", "index"): np.array(readings)}, guarded=weaker)
        for readings, weaker in ((free, False), (guarded, True))
    ]
    together = computed_limits([CHECK], hands)
    if len(together) == 1:
        for kind in hands:
            (alone,) = computed_limits([CHECK], [replace(kind, guarded=False)])
            assert together[0].at_least <= alone.at_least
            assert together[0].at_most >= alone.at_most
