"""How far apart repeated closures to one posture end."""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from hil.checks.shared.experiment import Measured, last_before, map_of
from hil.checks.shared.signals import display_unit, find_steps
from hil.recordings.recorder import LENGTH_UNITS
from hil.recordings.recording import Recording


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
