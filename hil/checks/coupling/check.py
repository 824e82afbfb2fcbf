"""Thumb coupling: effect of abduction on CMC flexion, and of CMC flexion on the flexor.

Records `codes`, `command_codes`, `currents` and `temperatures`.
"""

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import OPENED, Measured, Sampler, last_before, require
from hil.checks.shared.signals import find_steps
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

ABDUCTIONS = (0.0, 0.5, 1.0)
HOLD_S = 0.7
FURTHEST = (0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0)
"""Largest commanded fraction of each channel's window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close CMC flexion fully at three abductions."""
    recorder.begin({"hold_s": HOLD_S})
    driver = Sampler(target, recorder, progress, HOLD_S * (2 + 2 * len(ABDUCTIONS)))
    driver.hold(OPENED, HOLD_S, "open hand")
    for abduction in ABDUCTIONS:
        for flexion in (0.0, 1.0, 0.0):
            codes = OPENED.copy()
            codes[Channel.THUMB_ABDUCTION], codes[Channel.THUMB_CMC_FLEXION] = abduction * MAX_CODE, flexion * MAX_CODE
            driver.hold(codes, HOLD_S, f"abduction {abduction:.0%}")
    driver.hold(OPENED, HOLD_S, "open hand")


def measure(recording: Recording) -> Measured:
    """Return the stop of CMC flexion (% of its window) without and with abduction."""
    codes, commands = recording["codes"], recording["command_codes"]
    closing = [
        step
        for step in find_steps(commands.times, commands.values)
        if step.channel == Channel.THUMB_CMC_FLEXION and step.after > step.before
    ]
    require(len(closing) == len(ABDUCTIONS), "closings")
    rows = np.array([last_before(codes.times, codes.values, step.end) for step in closing]) * 100.0 / MAX_CODE
    stops = rows[:, Channel.THUMB_CMC_FLEXION]
    return {
        Channel.THUMB_CMC_FLEXION.label: {
            "stop_without_abduction": float(stops[0]),
            "stop_abducted": float(stops[2]),
        },
    }
