"""Holding: currents and heating of a half closed hand that holds still.

Leaves `codes`, `command_codes`, `currents` and `temperatures`.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import LOOSE_GRASP, Sampler
from hil.recordings.recorder import Progress, Recorder
from hil.targets.target import Target

OPEN_S, HOLD_S = 1.0, 8.0
FURTHEST = LOOSE_GRASP
"""How far each channel is sent at most, part of its window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Hold the open hand, a loose grasp, and the open hand again."""
    recorder.begin({"open_s": OPEN_S, "hold_s": HOLD_S})
    driver = Sampler(target, recorder, progress, 2 * OPEN_S + HOLD_S)
    opened = np.zeros(len(Channel))
    driver.hold(opened, OPEN_S, "open hand")
    driver.hold(MAX_CODE * np.array(LOOSE_GRASP), HOLD_S, "holding")
    driver.hold(opened, OPEN_S, "open hand")
