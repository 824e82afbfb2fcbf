"""What a checkpoint is worth, on trials whose answer is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from train.recipe import STEADY, Goal

rates = st.lists(st.floats(0.1, 0.9), min_size=3, max_size=60)
ALL = STEADY.goal


def test_a_lost_cube_costs_five_a_slow_hand_one_and_speed_beyond_one_brings_nothing():
    worth = ALL.worth(np.array([0.5, 0.5, 0.05, 3.0]), np.array([True, False, True, True]))
    np.testing.assert_allclose(worth, [0.5, -4.5, -0.95, 1.0])


@given(rates)
def test_the_bound_lies_below_the_mean_and_nears_it_with_more_trials(made):
    kept = np.ones(len(made), bool)
    bound = Goal().bound(np.array(made), kept)
    more = Goal().bound(np.tile(made, 10), np.tile(kept, 10))
    assert bound <= np.mean(made) + 1e-12
    assert bound <= more + 1e-12


def test_the_bound_is_the_one_sided_95_percent_one():
    made = np.array([0.2, 0.4, 0.6, 0.8])
    error = np.std(made, ddof=1) / 2
    assert Goal().bound(made, np.ones(4, bool)) == pytest.approx(0.5 - 1.645 * error)


@given(rates, st.integers(0, 59))
def test_losing_one_cube_more_is_never_worth_more(made, which):
    kept = np.ones(len(made), bool)
    before = ALL.bound(np.array(made), kept)
    kept[which % len(made)] = False
    assert ALL.bound(np.array(made), kept) < before
