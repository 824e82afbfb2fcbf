"""The history page: curves inside their frame, bands of the limits, three answers on drift, any number of runs."""

import re
from dataclasses import replace
from datetime import timedelta

import pytest
from hand_runs import BEGIN, LIMIT, MIDDLE, runs
from hypothesis import given
from hypothesis import strategies as st

from hil.history.drift import LEAST_RUNS, drifts_of, tracks_of
from hil.history.runs import Intervention, RunVerdict
from hil.history.timeline import HEIGHT, MAX_POINTS, WIDTH, no_drift, render_history, sparkline, trends_of

values = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=400)


def page(some):
    tracks = tracks_of(some)
    return render_history("bench", some, tracks, drifts_of(tracks))


@given(values)
def test_a_curve_stays_in_its_frame_and_ends_with_the_last_reading(readings):
    (track,) = tracks_of(runs(readings))
    line = sparkline(track, (track.dates[0], track.dates[-1]))
    assert 1 <= len(line.points) <= MAX_POINTS
    assert all(0 <= x <= WIDTH and 0 <= y <= HEIGHT for x, y in line.points)
    assert [x for x, _ in line.points] == sorted(x for x, _ in line.points)
    assert 0 <= line.band[0] <= line.band[1] <= HEIGHT
    inside = LIMIT.at_least <= readings[-1] <= LIMIT.at_most
    # Coordinates are rounded to a tenth.
    assert not inside or line.band[0] - 0.1 <= line.points[-1][1] <= line.band[1] + 0.1


def test_a_higher_reading_is_drawn_higher():
    (track,) = tracks_of(runs([MIDDLE, LIMIT.at_most]))
    (_, first), (_, last) = sparkline(track, (track.dates[0], track.dates[-1])).points
    assert last < first


@given(st.floats(-1e4, 1e4))
def test_a_last_reading_is_marked_if_and_only_if_it_is_outside_its_limits(value):
    some = runs([MIDDLE, value])
    (row,) = trends_of(tracks_of(some), some).rows
    assert row.cells[0].outside is not (LIMIT.at_least <= value <= LIMIT.at_most)


@pytest.mark.parametrize(
    ("count", "words"), [(1, "Not known"), (LEAST_RUNS - 1, "Not known"), (LEAST_RUNS, "No drift"), (1000, "No drift")]
)
def test_no_drift_is_claimed_of_too_few_runs(count, words):
    some = runs([MIDDLE] * count)
    assert no_drift(tracks_of(some)).startswith(words)
    assert page(some).count('class="readings"') == 1


def test_a_repair_is_marked_and_makes_the_drift_unknown():
    some = runs([MIDDLE] * 8, interventions={6: (Intervention("exchange", frozenset({"ring"})),)})
    assert "Not known" in page(some)
    assert page(some).count('class="repair"') == 1
    other = runs([MIDDLE] * 8, interventions={6: (Intervention("exchange", frozenset({"index"})),)})
    assert "No drift" in page(other)
    assert 'class="repair"' not in page(other)


def test_runs_that_were_not_judged_are_counted():
    some = [replace(run, verdict=RunVerdict.NOT_JUDGED) if k < 2 else run for k, run in enumerate(runs([MIDDLE] * 5))]
    assert "2 of 5 runs were not judged" in page(some)


def test_a_run_without_a_staircase_has_its_other_trends():
    some = [replace(run, measured={"presence": {"ring": {"temperature": 30.0}}}) for run in runs([MIDDLE])]
    assert trends_of(tracks_of(some), some).titles == ("temperature",)
    assert page(some).count('class="readings"') == 1


def test_runs_of_one_day_are_drawn_in_the_middle():
    some = runs([MIDDLE, MIDDLE], every_days=0.0)
    (track,) = tracks_of(some)
    assert {x for x, _ in sparkline(track, (BEGIN, BEGIN)).points} == {WIDTH / 2}
    later = sparkline(track, (BEGIN - timedelta(days=1), BEGIN + timedelta(days=1)))
    assert {x for x, _ in later.points} == {WIDTH / 2}


def test_no_cell_shows_a_negative_zero_or_a_number_that_is_none():
    assert not re.search(r">-0(\.0*)?[ <]|nan|None", page(runs([MIDDLE, MIDDLE - 1e-9])))
