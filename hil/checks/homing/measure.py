"""Time of a homing, and how far its zeros differ."""

from __future__ import annotations

import numpy as np

from aero.channels import CABLES
from hil.checks.shared.experiment import Measured, last_before, map_of
from hil.checks.shared.signals import find_steps
from hil.recordings.recording import Recording


def measure(recording: Recording) -> Measured:
    """Return the time of the slowest homing (s), and by how much each cable's closed end came out differently (mm)."""
    codes, commands = recording["codes"], recording["command_codes"]
    codec = map_of(recording.header)
    found: dict[str, dict[str, float]] = {}
    for channel in CABLES:
        openings = [
            step
            for step in find_steps(commands.times, commands.values)
            if step.channel == channel and step.after < step.before
        ]
        closed = np.array([last_before(codes.times, codes.values, step.start) for step in openings]).astype(int)
        travel = codec.travel_from_angles(codec.angles_from_codes(closed))[:, channel]
        found[channel.label] = {"homing_spread": 1e3 * float(np.ptp(travel))}
    return found | {"hand": {"homing_time": float(recording.header.parameters["slowest_s"])}}
