"""A short staircase: what tracking and rise time of every channel cost least, half a minute of hand time.

Each channel goes to a loose grasp, climbs two steps of 5 % of its range there, as the paper's staircase does, comes
down again and opens. Nothing meets a stop, so any firmware may run it, guarded or not. Five per cent tell most: a
servo's gain, its speed and its motion profile all show in such a step, and the hand's mechanics hardly do. Leaves what
`follow` leaves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from hil.checks.shared.experiment import LOOSE_GRASP
from hil.checks.shared.side_by_side import follow
from hil.checks.staircase.reachable_range import calibrated_range, reachable
from hil.recordings.recorder import Progress, Recorder
from hil.targets.target import Target
from model import RoutedHand

Floats = NDArray[np.float64]

STEP = 0.05
"""Part of the range, as each of the paper's twenty levels."""
STEPS = (0, 1, 2, 1, 0)
"""Levels above the grasp, one after another, before the channel opens again."""
HOLD_S, LEAD_S = 0.6, 0.6
"""Time at each level, and at the open hand before the first, s; 0.4 s after a change a sample counts as settled."""
SAMPLE_PERIOD_S = 0.02
FURTHEST = tuple(foot + STEP * max(STEPS) for foot in LOOSE_GRASP)
"""How far each channel is sent at most, part of its window, command order."""


def commands(open_lengths: Floats, closed_lengths: Floats) -> Floats:
    """Return the stream (n, 7) between where every channel waits and its closed end, both (7,); lengths, m and rad."""
    held = round(HOLD_S / SAMPLE_PERIOD_S)
    rows = [np.zeros((round(LEAD_S / SAMPLE_PERIOD_S), len(Channel)))]
    for channel, foot in zip(Channel, LOOSE_GRASP, strict=True):
        levels = [*(foot + STEP * step for step in STEPS), 0.0]
        rows.append(np.outer(np.repeat(levels, held), np.eye(len(Channel))[channel]))
    return open_lengths + np.vstack(rows) * (closed_lengths - open_lengths)


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Drive the target and the routed hand of its side through the steps."""
    simulator = RoutedHand(target.side)
    stream = commands(*reachable(target.map, calibrated_range(simulator)))
    follow(
        target,
        recorder,
        simulator,
        stream,
        period_s=SAMPLE_PERIOD_S,
        parameters={"step": STEP, "hold_s": HOLD_S, "lead_s": LEAD_S, "sample_period_s": SAMPLE_PERIOD_S},
        doing=lambda _: "short staircase",
        progress=progress,
    )
