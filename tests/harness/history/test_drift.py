"""Drift towards a limit: reported of hands that wear, and of no others."""

from dataclasses import replace

import numpy as np
import pytest
from hand_runs import HALF, LIMIT, MIDDLE, RING, runs
from hypothesis import given
from hypothesis import strategies as st

from hil.history.drift import Drift, drifts_of, tracks_of
from hil.history.runs import Intervention

TIMES = 20


def drifts(values, **said):
    return drifts_of(tracks_of(runs(values, **said)))


@given(st.integers(0, 2**32 - 1), st.sampled_from([-1.0, 1.0]), st.floats(0.01, 0.07))
def test_a_reading_that_wears_is_reported_before_its_limit_and_the_limit_is_met_when_said(seed, way, noise):
    noisy = np.random.default_rng(seed).normal(0.0, noise * HALF, TIMES)
    (drift,) = drifts(MIDDLE + way * np.linspace(0.0, 0.8, TIMES) * HALF + noisy)
    assert drift.bound == (LIMIT.at_most if way > 0 else LIMIT.at_least)
    assert drift.per_month * way > 0.0
    assert drift.interval[0] <= drift.per_month <= drift.interval[1]
    left = 0.2 / 0.8 * 7.0 * (TIMES - 1)
    # The limit is a fifth of the way off, and the trend of twenty noisy runs is known to about a tenth.
    assert left * 0.2 < drift.days_left < left * 2.5
    assert "a month" in drift.sentence
    assert "limit of" in drift.sentence


@pytest.mark.parametrize("seed", range(10))
def test_a_hand_that_does_not_wear_has_no_drift(seed):
    assert drifts(MIDDLE + np.random.default_rng(seed).normal(0.0, 0.2 * HALF, TIMES)) == []


def test_an_unchanged_hand_is_rarely_reported_although_its_history_is_read_after_every_run():
    """One history in a hundred by theory; without the division by the number of runs, five."""
    reported = 0
    for seed in range(100):
        values = MIDDLE + np.random.default_rng(seed).normal(0.0, HALF / 2.0, TIMES)
        (track,) = tracks_of(runs(values))
        read = (replace(track, dates=track.dates[:count], values=track.values[:count]) for count in range(5, TIMES + 1))
        reported += any(drifts_of([one]) for one in read)
    assert reported <= 3


@pytest.mark.parametrize("changed", [4, 6])
def test_a_reading_whose_median_slope_is_zero_has_no_drift(changed):
    values = np.where(np.arange(TIMES) < TIMES - changed, MIDDLE, MIDDLE + 0.5 * HALF)
    assert drifts(values) == []


def test_equal_readings_count_against_the_trend():
    assert drifts(MIDDLE + np.repeat([0.0, 0.4, 0.8], 2) * HALF) == []
    assert len(drifts(MIDDLE + np.repeat([0.0, 0.2, 0.4, 0.6, 0.8], 2) * HALF)) == 1


@given(st.integers(0, 4))
def test_nothing_is_reported_of_fewer_than_five_runs(count):
    assert drifts(MIDDLE + np.linspace(0.0, 0.8, count) * HALF) == []


@given(st.integers(1, TIMES - 2))
def test_an_exchange_begins_anew(at):
    exchanged = {at: (Intervention("exchange", frozenset({RING})),)}
    values = np.where(np.arange(TIMES) <= at, MIDDLE - 0.6 * HALF, MIDDLE + 0.6 * HALF)
    assert drifts(values, interventions=exchanged) == []


def test_a_step_on_another_channel_changes_nothing():
    worn = MIDDLE + np.linspace(0.0, 0.8, TIMES) * HALF
    elsewhere = {10: (Intervention("exchange", frozenset({"index"})),)}
    assert len(drifts(worn, interventions=elsewhere)) == 1
    assert len(drifts(worn, interventions={10: (Intervention("power", frozenset()),)})) <= 1


def test_a_drift_away_from_any_limit_within_a_year_is_not_reported():
    assert drifts(MIDDLE + np.linspace(0.0, 0.05, TIMES) * HALF) == []


def test_a_reading_past_its_limit_says_so():
    (drift,) = drifts(MIDDLE + np.linspace(0.0, 1.3, TIMES) * HALF)
    assert isinstance(drift, Drift)
    assert drift.days_left == 0.0
    assert "past its limit" in drift.sentence


@pytest.mark.parametrize(
    ("days", "words"),
    [(0.0, "past its limit"), (40.0, "about 40 days"), (70.0, "about 2 months"), (300.0, "10 months")],
)
def test_what_is_left_is_said_in_days_and_from_two_months_on_in_months(days, words):
    (drift,) = drifts(MIDDLE + np.linspace(0.0, 0.8, TIMES) * HALF)
    assert words in replace(drift, days_left=days).sentence
