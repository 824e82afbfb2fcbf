"""Where CMC flexion stops at each abduction, and what it drags along."""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import Measured, last_before
from hil.checks.shared.signals import find_steps
from hil.recordings.recording import Recording


def measure(recording: Recording) -> Measured:
    """Return where CMC flexion stops (% of its window) without and with abduction, and by how much that moves it."""
    codes, commands = recording["codes"], recording["command_codes"]
    closing = [
        step
        for step in find_steps(commands.times, commands.values)
        if step.channel == Channel.THUMB_CMC_FLEXION and step.after > step.before
    ]
    rows = np.array([last_before(codes.times, codes.values, step.end) for step in closing]) * 100.0 / MAX_CODE
    stops = rows[:, Channel.THUMB_CMC_FLEXION]
    before = np.array([last_before(codes.times, codes.values, step.start) for step in closing]) * 100.0 / MAX_CODE
    dragged = np.abs(rows - before)[:, Channel.THUMB_FLEXOR]
    return {
        Channel.THUMB_CMC_FLEXION.label: {
            "stop_without_abduction": float(stops[0]),
            "stop_half_abducted": float(stops[1]),
            "stop_abducted": float(stops[2]),
            "stop_shift": float(stops[2] - stops[0]),
        },
        Channel.THUMB_FLEXOR.label: {"dragged_by_cmc": float(dragged.max())},
    }
