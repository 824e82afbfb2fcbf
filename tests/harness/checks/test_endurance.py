"""Endurance, on recordings made by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.endurance import check as endurance
from hil.recordings.errors import CannotBeMeasuredError
from tests.support.synthetic import held


def recording_of(cycles, range_drift=0.0, current_drift=0.0):
    """A hand whose range (%) and current (A) change evenly from the first to the last cycle."""
    part = np.arange(cycles) / max(cycles - 1, 1)
    commands, answer = np.zeros((1 + 2 * cycles, 7)), np.zeros((1 + 2 * cycles, 7))
    commands[1::2] = MAX_CODE
    answer[1::2] = MAX_CODE * (0.9 + range_drift * part[:, None] / 100)
    # On a right hand the thumb's flexor is mounted the other way round.
    current = np.zeros((len(commands) * 10, 7))
    current[10:] = np.repeat(np.stack([2.0 + current_drift * part, 0.0 * part], 1).ravel(), 10)[:, None]
    return held("endurance", commands, 0.1, answer=answer, currents=current * [1, 1, 1, 1, 1, 1, -1])


@settings(max_examples=20)
@given(st.integers(2, 60), st.floats(-5, 5), st.floats(-1, 1))
def test_a_steady_drift_comes_out(cycles, range_drift, current_drift):
    found = endurance.measure(recording_of(cycles, range_drift, current_drift))
    kept = 1 - (max(1, round(0.1 * cycles)) - 1) / (cycles - 1)  # between the middles of the first and the last tenth
    for channel in Channel:
        assert found[channel.label]["range_drift"] == pytest.approx(range_drift * kept, abs=1e-9)
        assert found[channel.label]["current_drift"] == pytest.approx(current_drift * kept, abs=1e-9)


def test_one_cycle_has_no_drift():
    with pytest.raises(CannotBeMeasuredError, match="two cycles"):
        endurance.measure(recording_of(1))
