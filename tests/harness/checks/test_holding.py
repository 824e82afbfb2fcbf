"""Holding, on a recording made by hand: 10 s at 0.1 s a sample."""

import numpy as np
import pytest

from aero.protocol import MAX_CODE
from hil.checks.holding import check as holding
from tests.support.synthetic import LABELS, held


def test_holding_current_and_creep_are_the_recorded_ones():
    """Currents 0.1 to 0.7 A and a creep of 1 to 7 % while it holds."""
    each = np.arange(1, 8)
    n = 100
    codes = np.full((n, 7), 0.5 * MAX_CODE)
    codes[40:60] += each / 100 * MAX_CODE
    currents = np.where(np.arange(n)[:, None] == 50, 9.0, each / 10 * [1, 1, 1, 1, 1, 1, -1])
    recording = held("holding", codes, 0.1, dt=0.1, currents=currents)
    found = holding.measure(recording)
    for i, label in zip(each, LABELS, strict=True):
        assert found[label] == pytest.approx({"holding_current": i / 10, "creep_percent": i})


def test_what_happens_before_and_after_the_hold_is_not_held():
    """Motion and current outside 2 to 9 s count for nothing."""
    t = 0.1 * np.arange(100)
    outside = ((t < 1.95) | (t > 9.05))[:, None] * np.ones(7)
    found = holding.measure(held("holding", outside * MAX_CODE, 0.1, dt=0.1, currents=5.0 * outside))
    for label in LABELS:
        assert found[label] == {"holding_current": 0.0, "creep_percent": 0.0}
