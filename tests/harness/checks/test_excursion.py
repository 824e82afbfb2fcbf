"""Excursion, on recordings made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.excursion import check as excursion
from hil.checks.shared.signals import find_steps
from hil.recordings.recording import Series
from tests.support.synthetic import LABELS, held

WINDOW = (45.258, 45.258, 45.258, 45.258, 1745.33, 16.356, 41.222)
"""The windows of firmware 0.2.0, mm (mrad)."""
SIMULATED = (44.49, 44.77, 44.59, 44.32, 1539.4, 6.55, 25.6)
"""Travel of the simulator from open to a fist under firmware 0.2.0, mm (mrad)."""


def test_every_number_is_the_recorded_one():
    """Channel i closes to 91 to 97 % under 0.1 to 0.7 A; the fist goes from 1 % to 81 to 87 %."""
    each = np.arange(1, 8)
    command, answer, load = [np.zeros(7)], [np.full(7, 0.01)], [np.zeros(7)]
    for channel in range(7):
        alone = np.eye(7)[channel]
        command += [alone, np.zeros(7)]
        answer += [alone * (0.9 + each / 100), np.full(7, 0.01)]
        load += [alone * each / 10, np.zeros(7)]
    command += [np.ones(7), np.zeros(7)]
    answer += [0.8 + each / 100, np.zeros(7)]
    load += [np.full(7, 5.0), np.zeros(7)]
    currents = np.repeat(load, 45, axis=0) * [1, 1, 1, 1, 1, 1, -1]
    recording = held(
        "excursion",
        np.array(command) * MAX_CODE,
        0.9,
        answer=np.array(answer) * MAX_CODE,
        currents=np.vstack([currents[:1], currents[:-1]]),
        dt=0.02,
    )
    found = excursion.measure(recording)
    for i, label in enumerate(LABELS):
        closed = 0.91 + i / 100
        assert found[label]["closed_percent"] == pytest.approx(100 * closed, abs=0.01)
        assert found[label]["stop_current"] == pytest.approx(0.1 * (i + 1))
        assert found[label]["fist_travel"] == pytest.approx((0.8 + i / 100) * WINDOW[i], rel=1e-3)
        # The thumb slides along the palm on its way.
        near = 0.01 if i < 4 else 0.05 * SIMULATED[i]
        assert found[label]["fist_difference"] == pytest.approx(
            abs(SIMULATED[i] - found[label]["fist_travel"]), abs=near
        )
    assert found["ring"]["fist_difference"] == pytest.approx(44.59 - 0.82 * 45.258, abs=0.01)
    assert_current_on_the_way_is_left_out(recording)


def assert_current_on_the_way_is_left_out(recording):
    """A host that was held up for the end of the ring's hold has read its current only before."""
    currents = recording["currents"]
    start, end = next((s.start, s.end) for s in closings(recording) if s.channel == Channel.RING)
    there = (currents.times < start + 0.5) | (currents.times > end)
    late = Series.of(currents.columns, currents.units, currents.times[there], currents.values[there])
    found = excursion.measure(replace(recording, series={**recording.series, "currents": late}))
    assert "stop_current" not in found["ring"]
    assert "stop_current" in found["pinky"]


def closings(recording):
    commands = recording["command_codes"]
    return [step for step in find_steps(commands.times, commands.values) if step.after > step.before][: len(LABELS)]
