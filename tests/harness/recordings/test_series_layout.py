"""Columns and units of a file are read, not assumed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.recordings.errors import UnusableFileError
from hil.recordings.recording import Series
from hil.recordings.series_layout import FACTORS, LABELS, SERIES_UNITS, conformed


def ours(name):
    return Series.of(LABELS, SERIES_UNITS[name], [0.0, 0.1], np.arange(14.0).reshape(2, 7))


@given(st.sampled_from(sorted(SERIES_UNITS)), st.permutations(range(7)))
def test_columns_in_another_order_are_taken_by_their_names(name, order):
    series = ours(name)
    other = Series.of(
        [LABELS[i] for i in order], [SERIES_UNITS[name][i] for i in order], series.times, series.values[:, order]
    )
    assert conformed(name, other) == series


@pytest.mark.parametrize(("unit", "own"), FACTORS)
def test_a_unit_that_is_another_word_for_ours_is_converted(unit, own):
    name, at = next((name, units.index(own)) for name, units in SERIES_UNITS.items() if own in units)
    series = ours(name)
    units = [unit if i == at else given for i, given in enumerate(series.units)]
    values = series.values.copy()
    values[:, at] /= FACTORS[unit, own]
    read = conformed(name, Series.of(LABELS, units, series.times, values))
    assert read.units == SERIES_UNITS[name]
    assert read.values == pytest.approx(series.values)


def test_what_cannot_be_read_is_refused_by_name():
    series = ours("currents")
    with pytest.raises(UnusableFileError, match="series currents gives index in 'V', which cannot be read as 'A'"):
        conformed("currents", Series.of(LABELS, ["V"] * 7, series.times, series.values))
    with pytest.raises(UnusableFileError, match="series currents has the columns index, middle"):
        conformed("currents", Series.of(LABELS[:2], ["A"] * 2, series.times, series.values[:, :2]))


def test_a_series_of_others_stays_as_it_is():
    series = Series.of(["x"], ["furlong"], [0.0], [[1.0]])
    assert conformed("camera", series) == series
