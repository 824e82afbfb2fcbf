"""Excursion: how far each channel goes alone, how hard it is stopped, and the whole hand from open to fist.

The full code range is commanded, whatever the map says, so the end stops show where the command window really lies.
The paper's kinematic validation: the fist of the hand less that of the simulator under the same commands.
Leaves `codes`, `command_codes`, `currents` and `temperatures`.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from hil.checks.excursion.measure import FIST
from hil.checks.shared.experiment import Sampler, one_closed
from hil.recordings.recorder import Progress, Recorder
from hil.targets.target import Target

HOLD_S = 0.9
"""Time at either end, s: a finger of firmware `pre` needs 0.7 s for its range."""
FURTHEST = (1.0,) * 7
"""How far each channel is sent at most, part of its window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close and open each channel alone, then close all to a fist."""
    recorder.begin({"hold_s": HOLD_S})
    driver = Sampler(target, recorder, progress, HOLD_S * (2 + len(FIST) + 2 * len(Channel)))
    opened = np.zeros(len(Channel))
    driver.hold(opened, HOLD_S, "open hand")
    for channel in Channel:
        driver.hold(one_closed(channel, 1.0), HOLD_S, channel.label)
        driver.hold(opened, HOLD_S, channel.label)
    for codes in FIST:
        driver.hold(codes, HOLD_S, "fist")
    driver.hold(opened, HOLD_S, "open hand")
