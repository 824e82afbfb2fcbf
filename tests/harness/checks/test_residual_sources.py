"""The parts of the tracking error are found where they were put."""

import numpy as np
import pytest

from aero.channels import Channel
from hil.checks.staircase.residual_sources import details, residual_sources
from tests.support.synthetic import RANGES, replaced, staircase

RING = Channel.RING


@pytest.mark.parametrize(("series", "source"), [("hand", "hand"), ("model", "simulator"), ("goal", "map")])
def test_a_constant_error_is_attributed_to_its_source(series, source):
    perfect = staircase(tau=0.03, hand_tau=0.03)
    error = 0.02 * RANGES[RING]
    changed = perfect[series].values.copy()
    changed[:, RING] += error
    recording = replaced(perfect, series, changed)
    if series == "goal":
        recording = replaced(recording, "hand", perfect["hand"].values + error * (np.arange(7) == RING))
    found = residual_sources(recording)[RING]
    assert found[source] == pytest.approx(1e3 * error, rel=0.01)
    assert all(found[other] < 0.05 * found[source] for other in found if other != source)
    assert details(recording).rows[RING][2:] == tuple(f"{value:.2f}" for value in found.values())
