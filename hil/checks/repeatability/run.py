"""Repeatability: how closely the hand comes back to one posture, closed to it again and again from the open pose.

The paper's definition of repeatability. Asked for by name only. Leaves `codes` and `command_codes`.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import LOOSE_GRASP, Sampler
from hil.recordings.recorder import Progress, Recorder
from hil.targets.target import Target

CLOSURES = 10
HOLD_S = 1.2
"""Time open and closed, s: the firmware `pre` needs 0.6 s for the way, and the hand then creeps in friction."""
FURTHEST = LOOSE_GRASP
"""How far each channel is sent at most, part of its window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close the open hand to the loose grasp again and again."""
    recorder.begin({"closures": CLOSURES, "hold_s": HOLD_S})
    driver = Sampler(target, recorder, progress, HOLD_S * (1 + 2 * CLOSURES))
    opened = np.zeros(len(Channel))
    driver.hold(opened, HOLD_S, "open hand")
    for i in range(CLOSURES):
        driver.hold(MAX_CODE * np.array(LOOSE_GRASP), HOLD_S, f"closure {i + 1}")
        driver.hold(opened, HOLD_S, f"closure {i + 1}")
