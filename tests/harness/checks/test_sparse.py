"""A recording that lacks samples is one that cannot be measured, and no mistake of the program or of the hand."""

from dataclasses import replace

import pytest

from hil.checks import EXPERIMENTS
from hil.checks.shared.experiment import record
from hil.emulated.any_hand import open_target
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recording import Series

NAMES = ("presence", "audit", "response", "coupling", "holding", "replay")
PARTS = {
    "none": slice(0, 0),
    "first": slice(0, 1),
    "two": slice(0, 2),
    "last": slice(-1, None),
    "beginning": slice(0, 20),
    "end": slice(20, None),
    "every seventh": slice(0, None, 7),
}


@pytest.fixture(scope="module")
def recordings():
    with open_target("emulated") as target:
        return {name: record(EXPERIMENTS[name], target) for name in NAMES}


def measured(recording):
    """Return readings, or None of a recording that cannot be measured; anything else is raised."""
    try:
        return EXPERIMENTS[recording.header.experiment].measure(recording)
    except CannotBeMeasuredError:
        return None


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("part", PARTS.values(), ids=PARTS)
@pytest.mark.parametrize("name", NAMES)
def test_each_series_once_with_a_part_of_its_samples(recordings, name, part):
    recording = recordings[name]
    for series_name, series in recording.series.items():
        fewer = Series.of(series.columns, series.units, series.times[part], series.values[part])
        found = measured(replace(recording, series={**recording.series, series_name: fewer}))
        assert found is None or len(fewer.times) > 1


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", NAMES)
def test_each_series_once_absent_and_all_bytes(recordings, name):
    recording = recordings[name]
    for absent in recording.series:
        rest = {one: series for one, series in recording.series.items() if one != absent}
        measured(replace(recording, series=rest))
    measured(replace(recording, wire=()))
