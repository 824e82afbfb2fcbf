"""Repeatability and endurance, on recordings made by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.repeatability import check as repeatability
from hil.recordings.errors import CannotBeMeasuredError
from tests.support.synthetic import held

WINDOW = (45.258, 45.258, 45.258, 45.258, 1745.33, 16.356, 41.222)
"""Of firmware 0.2.0, mm of cable, abduction mrad."""


def test_the_spread_is_that_of_the_ends_of_the_closures():
    """Three closures end at 50 %, at 1 to 7 % more, and at 49 %; on their way they are elsewhere."""
    shares = np.arange(1, 8) / 100
    command, answer = [np.zeros(7)], [np.zeros(7)]
    for closed in (np.full(7, 0.5), 0.5 + shares, np.full(7, 0.49)):
        command += [np.full(7, 0.5), np.full(7, 0.5), np.zeros(7)]
        answer += [np.full(7, 0.3), closed, np.zeros(7)]
    recording = held("repeatability", np.array(command) * MAX_CODE, 0.6, answer=np.array(answer) * MAX_CODE)
    found = repeatability.measure(recording)
    for channel in Channel:
        expected = (0.01 + shares[channel]) * WINDOW[channel]
        assert found[channel.label]["closure_spread"] == pytest.approx(expected, rel=2e-3)


def recording_of(cycles, range_drift=0.0, current_drift=0.0):
    """A hand whose range (%) and current (A) change evenly from the first to the last cycle."""
    part = np.arange(cycles) / max(cycles - 1, 1)
    commands, answer = np.zeros((1 + 2 * cycles, 7)), np.zeros((1 + 2 * cycles, 7))
    commands[1::2] = MAX_CODE
    answer[1::2] = MAX_CODE * (0.9 + range_drift * part[:, None] / 100)
    # On a right hand the thumb's flexor is mounted the other way round.
    current = np.zeros((len(commands) * 10, 7))
    current[10:] = np.repeat(np.stack([2.0 + current_drift * part, 0.0 * part], 1).ravel(), 10)[:, None]
    return held("repeatability", commands, 0.1, answer=answer, currents=current * [1, 1, 1, 1, 1, 1, -1])


@settings(max_examples=20)
@given(st.integers(2, 60), st.floats(-5, 5), st.floats(-1, 1))
def test_a_steady_drift_comes_out(cycles, range_drift, current_drift):
    found = repeatability.measure(recording_of(cycles, range_drift, current_drift))
    kept = 1 - (max(1, round(0.1 * cycles)) - 1) / (cycles - 1)  # between the middles of the first and the last tenth
    for channel in Channel:
        assert found[channel.label]["range_drift"] == pytest.approx(range_drift * kept, abs=1e-9)
        assert found[channel.label]["current_drift"] == pytest.approx(current_drift * kept, abs=1e-9)


def test_one_closure_is_not_measured():
    with pytest.raises(CannotBeMeasuredError, match="two closures"):
        repeatability.measure(recording_of(1))
