"""The channel audit, on a recording made by hand."""

import numpy as np
import pytest

from aero.protocol import MAX_CODE
from hil.checks.audit import check as audit
from tests.support.synthetic import LABELS, held, replaced

SPANS = (3278, 3278, 3278, 3278, 1138, 1183, 2980)
"""Servo counts of the windows of firmware 0.2.0."""
NUDGE = 0.2


def recorded(answer=None, currents=None):
    command = np.zeros((15, 7))
    command[1::2] = NUDGE * np.eye(7)
    answer = None if answer is None else answer * MAX_CODE
    return held("audit", command * MAX_CODE, 0.6, answer=answer, currents=currents)


def test_every_number_is_the_recorded_one():
    """Channel i follows by 80 + i %, stays 10 + i % short of the way back, and drags its neighbour by -(20 + i) %.

    It is pulled by 0.1 to 0.7 A more than at rest, and rests where the nudge before left it.
    """
    answer, currents = np.zeros((15, 7)), np.full((15, 7), 0.05)
    for i in range(7):
        nudged = 1 + 2 * i
        rest = answer[nudged - 1]
        answer[nudged] = rest + NUDGE * (0.80 + i / 100) * np.eye(7)[i] - NUDGE * (0.20 + i / 100) * np.eye(7)[i - 1]
        answer[nudged + 1] = rest + NUDGE * (0.10 + i / 100) * np.eye(7)[i]
        currents[nudged, i] += 0.1 * (i + 1)
    currents = np.repeat(currents * [1, 1, 1, 1, 1, 1, -1], 60, axis=0)
    found = audit.measure(recorded(answer + 0.3, np.vstack([currents[:1], currents[:-1]])))
    for i, label in enumerate(LABELS):
        assert found[label]["followed"] == pytest.approx(80 + i)
        assert found[label]["others_moved"] == pytest.approx(20 + i)
        assert found[label]["pull"] == pytest.approx(0.1 * (i + 1))


def test_readings_on_the_grid_of_the_window_fit_and_others_do_not():
    """All readings lie on their window's grid, but a quarter of the ring's and all of the flexor's."""
    counts = np.round(NUDGE * np.vstack([np.zeros(7), np.repeat(np.eye(7), 2, axis=0)]) * SPANS)
    recording = recorded(np.floor(counts * MAX_CODE / SPANS) / MAX_CODE)
    codes = np.round(recording["codes"].values)
    codes[: len(codes) // 4, 2] += 3
    codes[:, 6] += 3
    found = audit.measure(replaced(recording, "codes", codes))
    for label in LABELS:
        expected = {"ring": 75.0, "thumb_flexor": 0.0}.get(label, 100.0)
        assert found[label]["quantum_fits"] == pytest.approx(expected), label


def test_a_current_that_was_read_after_the_command_to_open_is_not_the_nudge():
    """Currents are read ten times a second; the first one under each command shows the servo's answer to it."""
    currents = np.full((15, 7), 0.05)
    currents[1::2] += 0.1 * np.eye(7)
    currents = np.repeat(currents * [1, 1, 1, 1, 1, 1, -1], 60, axis=0)
    recording = recorded(currents=currents)
    sampled = recording["currents"]
    values = sampled.values.copy()
    opened = np.flatnonzero(np.diff(values[:, 0])) + 1
    values[opened] = -3.0
    found = audit.measure(replaced(recording, "currents", values))
    assert found["index"]["pull"] == pytest.approx(0.1)
