"""Presence, on a recording made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from hil.experiments import presence
from hil.experiments.staircase.metrics import resolution
from hil.experiments.staircase.settled import residuals
from hil.recordings.recording import Recording, Series
from hil.targets.wire_log import WireRecord
from tests.support.synthetic import HEADER, LABELS, RANGES, replaced, staircase


def test_every_number_of_presence_is_the_recorded_one():
    """Three distinct currents of 30, peaks of 31 to 37 degC, one reply of four lost, trips of 1, 2 and 6 ms."""
    each, t = np.arange(1, 8), 0.025 * np.arange(30)
    currents = -0.1 * each * np.ones((30, 7))
    currents[3], currents[7] = 5.0, 6.0
    temperatures = np.full((30, 7), 30.0)
    temperatures[11] += each
    series = {
        "currents": Series.of(LABELS, ["A"] * 7, t, currents),
        "temperatures": Series.of(LABELS, ["degC"] * 7, t, temperatures),
    }
    wire = [WireRecord(0.1 * i, "to_hand", bytes(16)) for i in range(4)]
    wire += [WireRecord(0.1 * i + trip, "from_hand", bytes(16)) for i, trip in enumerate((0.001, 0.002, 0.006))]
    header = replace(HEADER, experiment="presence", parameters={"boot_text": ""})
    found = presence.measure(Recording(header, series, tuple(sorted(wire))))
    for i, label in zip(each, LABELS, strict=True):
        assert found[label] == pytest.approx({"temperature": 30 + i, "idle_current": i / 10})
    expected = {"lost_replies": 25.0, "round_trip": 2.0, "distinct_readings": 3.0, "boot_contradictions": 0.0}
    assert found["hand"] == pytest.approx(expected)


@pytest.mark.parametrize("grid", [1, 4, 8])
def test_resolution_is_the_grid_of_the_encoder(grid):
    """Counts of a grid, in a window of 1000, come back from their codes."""
    counts = grid * np.arange(100)
    assert resolution(np.floor(counts * 65535 / 1000), 1000) == grid


def test_a_hand_that_shakes_is_not_settled():
    """It swings by 2 % of its range from sample to sample, under a quiet command."""
    recording = staircase()
    hand = recording["hand"].values.copy()
    hand[::2, 2] += 0.02 * RANGES[2]
    _, settled = residuals(replaced(recording, "hand", hand))
    assert not settled[1:, 2].any()
    assert settled[:, 1].any()
