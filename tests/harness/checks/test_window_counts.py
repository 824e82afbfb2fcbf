"""The counts of a window's ends, on a recording made by hand."""

import numpy as np
import pytest

from aero.channels import CABLES, FINGERS, Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import map_of
from hil.checks.window import check as window
from hil.checks.window.check import WOUND
from tests.support.synthetic import HEADER, LABELS, held

SPAN = 3278
"""Counts of a finger's window."""
STOP, PULLS_FROM, PULL_A = 0.97, 0.1, 0.5
"""Parts of the window at which a finger stops and its cable begins to pull, and how strongly."""


def test_every_number_is_the_recorded_one():
    """Every cable has 328 counts of slack, every finger 98 beyond its stop, and the ring's window was moved by 40."""
    commands, reached = [np.zeros(7)], [np.zeros(7)]
    for channel in CABLES:
        parts = [*np.linspace(0.0, WOUND, 71)[1:], *([1.0, 1.0] if channel in FINGERS else []), 0.0]
        commands += [np.eye(7)[channel] * part for part in parts]
        reached += [np.eye(7)[channel] * min(part, STOP) for part in parts]
    loads = PULL_A * (np.array(reached) > PULLS_FROM) * [1, 1, 1, 1, 1, 1, -1]
    extends = map_of(HEADER).window.extend_counts
    opening = np.sign(extends[Channel.RING] - map_of(HEADER).window.grasp_counts[Channel.RING])
    told = {f"extend_{label}": extend for label, extend in zip(LABELS, extends, strict=True)}
    told["extend_ring"] += int(40 * opening)
    recording = held(
        "window",
        np.array(commands) * MAX_CODE,
        0.05,
        answer=np.array(reached) * MAX_CODE,
        currents=loads,
        dt=0.05,
        **told,
        **{f"stop_{finger.label}": "" for finger in FINGERS},
    )
    found = window.measure(recording)
    for finger in FINGERS:
        assert found[finger.label]["slack"] == pytest.approx(PULLS_FROM * SPAN, abs=40)
        assert found[finger.label]["left_closed"] == pytest.approx((1.0 - STOP) * SPAN, abs=1)
        assert found[finger.label]["window_moved"] == (40 if finger is Channel.RING else 0)
