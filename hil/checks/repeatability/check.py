"""Repeatability: how closely the hand returns to one posture, closed to it again and again from the open pose.

The paper's definition of repeatability. Asked for by name only. Leaves `codes` and `command_codes`.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import LOOSE_GRASP, Measured, Sampler, last_before, map_of
from hil.checks.shared.signals import display_unit, find_steps
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.recordings.series_layout import LENGTH_UNITS
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


def measure(recording: Recording) -> Measured:
    """Return the greatest less the smallest place of each channel at the end of the closures (mm of cable, mrad)."""
    codes, commands = recording["codes"], recording["command_codes"]
    codec = map_of(recording.header)
    openings = {s.start for s in find_steps(commands.times, commands.values) if s.after < s.before}
    closed = np.array([last_before(codes.times, codes.values, start) for start in sorted(openings)]).astype(int)
    spread = np.ptp(codec.travel_from_angles(codec.angles_from_codes(closed)), axis=0)
    return {
        channel.label: {"closure_spread": display_unit(LENGTH_UNITS[channel])[1] * float(spread[channel])}
        for channel in Channel
    }
