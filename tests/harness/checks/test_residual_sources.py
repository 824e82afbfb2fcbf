"""The parts of the tracking error are found where they were put."""

import numpy as np
import pytest
from synthetic import RANGES, replaced, staircase

from aero.channels import Channel
from hil.checks.staircase.residual_sources import residual_sources
from hil.checks.staircase.tracking import residuals

RING = Channel.RING


@pytest.fixture(scope="module")
def perfect():
    return staircase(tau=0.03, hand_tau=0.03)


def windows(recording, channel):
    """Rows of a channel's way up, its way down and the rest."""
    moved = np.flatnonzero(recording["command"].values[:, channel])
    top = moved[np.argmax(recording["command"].values[moved, channel])]
    rows = np.arange(len(recording["hand"].times))
    end = moved[-1] + 48
    turn = top + 48
    return (rows >= moved[0]) & (rows < turn), (rows >= turn) & (rows <= end), (rows < moved[0]) | (rows > end)


@pytest.mark.parametrize(("part", "index"), [("closing", 0), ("opening", 1), ("others", 2)])
def test_an_offset_in_one_part_of_the_run_is_attributed_to_it(perfect, part, index):
    hand = perfect["hand"].values.copy()
    hand[windows(perfect, RING)[index], RING] += 0.01 * RANGES[RING]
    recording = replaced(perfect, "hand", hand)
    found = residual_sources(recording)
    assert found[RING].share[part] > 0.9
    assert sum(found[RING].share.values()) == pytest.approx(1.0)
    assert found[Channel.INDEX].source["hand"] == pytest.approx(0.0, abs=1e-3)


def test_a_blocked_top_is_called_stopped(perfect):
    hand = perfect["hand"].values.copy()
    hand[:, RING] = np.minimum(hand[:, RING], 0.6 * RANGES[RING])
    attribution = residual_sources(replaced(perfect, "hand", hand))[RING]
    assert attribution.share["stopped"] > 0.5


@pytest.mark.parametrize(("series", "source"), [("hand", "hand"), ("model", "simulator"), ("goal", "map")])
def test_a_constant_error_is_attributed_to_its_source(perfect, series, source):
    error = 0.02 * RANGES[RING]
    changed = perfect[series].values.copy()
    changed[:, RING] += error
    recording = replaced(perfect, series, changed)
    if series == "goal":
        recording = replaced(recording, "hand", perfect["hand"].values + error * (np.arange(7) == RING))
    found = residual_sources(recording)[RING].source
    assert found[source] == pytest.approx(1e3 * error, rel=0.01)
    assert all(found[other] < 0.05 * found[source] for other in found if other != source)


def test_the_shares_of_each_part_are_the_recorded_ones(perfect):
    """The ring stands off by 1, 2 and 3 % while it closes, while it opens and while others move."""
    closing, opening, others = windows(perfect, RING)
    error = 0.01 * closing + 0.02 * opening + 0.03 * others
    hand = perfect["hand"].values.copy()
    hand[:, RING] += error * RANGES[RING]
    recording = replaced(perfect, "hand", hand)
    _, settled = residuals(recording)
    counts = [int((part & settled[:, RING]).sum()) for part in (closing, opening, others)]
    found = residual_sources(recording)[RING]
    for i, part in enumerate(("closing", "opening", "others")):
        squares = [count * (i + 1) ** 2 for i, count in enumerate(counts)]
        assert found.share[part] == pytest.approx(squares[i] / sum(squares), rel=0.05)
    assert found.share["stopped"] == 0.0
    assert found.where.split(", ")[0].endswith("while others are swept (most: index)")
