"""What the staircase adds to the rows of the validation table, on recordings made by hand."""

import numpy as np
import pytest

from aero.channels import CABLES, Channel
from hil.checks.staircase.check import measure, resolution
from tests.support.synthetic import RANGES, replaced, staircase


@pytest.mark.parametrize("grid", [1, 4, 8])
def test_resolution_is_the_grid_of_the_encoder(grid):
    """Counts of a grid, in a window of 1000, come back from their codes."""
    counts = grid * np.arange(100)
    assert resolution(np.floor(counts * 65535 / 1000), 1000) == grid


def test_resolution_is_that_of_nineteen_of_twenty_steps():
    """Two of fifty steps are of one count, the others of eight; of three they are the finest twentieth."""
    steps = np.full(50, 8)
    steps[[10, 30]] = 1
    assert resolution(np.floor(np.cumsum(steps) * 65535 / 1000), 1000) == 8
    steps[20] = 1
    assert resolution(np.floor(np.cumsum(steps) * 65535 / 1000), 1000) < 8


def test_a_reading_exactly_on_a_count_is_that_count_and_one_reading_has_no_resolution():
    """The open hand reads 0; eight counts of 1000 read 524."""
    assert resolution(np.array([0.0, 524.0]), 1000) == 8
    assert np.isnan(resolution(np.full(9, 7.0), 1000))


def test_every_number_of_a_channel():
    """Springs of 0.35 A at full closure; a hand that stops 1 % of each range too far, on a grid of four counts."""
    recording = staircase(levels=10, tau=0.02, hand_tau=0.02, offset=0.01)
    recording = replaced(recording, "currents", 0.5 * recording["currents"].values)
    n = len(recording["codes"].times)
    spans = np.array((3278, 3278, 3278, 3278, 1138, 1183, 2980))
    counts = np.minimum(4 * np.arange(n)[:, None] * np.ones(7), spans - 1)
    found = measure(replaced(recording, "codes", np.floor(counts * 65535 / spans)))
    for channel in Channel:
        row = found[channel.label]
        assert row["tracking_rms"] == pytest.approx(10 * RANGES[channel])
        assert row["worst_percent"] == pytest.approx(1.0)
        assert row["resolution"] == 4.0
        # From 0.40 s to 0.47 s of each of 20 x 7 + 1 levels of 48 samples.
        assert row["settled_percent"] == pytest.approx(100 * 8 / 48)
        if channel in CABLES:
            assert row["spring"] == pytest.approx(0.35 * 0.5)
            assert row["friction"] == pytest.approx(0.0, abs=1e-9)
            # At the first of ten levels the spring pulls with 0.035 A; a cable is taut from 0.04 A.
            assert row["take_up"] == pytest.approx(100 * RANGES[channel], rel=0.01)
        judged = channel in CABLES and channel is not Channel.THUMB_CMC_FLEXION
        assert ("spring_shape" in row) is judged
        if judged:
            assert row["spring_shape"] == pytest.approx(6.5 / 3.0, rel=0.1)
        if channel not in CABLES:
            assert not {"spring", "friction", "take_up"} & row.keys()
