"""Endurance: how range and current of a hand drift while it opens and closes fifty times.

Asked for by name only. Leaves `codes`, `command_codes` and `currents`.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import Measured, Sampler, last_before, require
from hil.checks.shared.signals import closing_current, find_steps
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

CYCLES = 50
HALF_S = 0.9
"""Time to close, and to open again, s."""
ENDS = 0.1
"""Fraction of the cycles at the beginning and at the end whose medians are compared."""
FURTHEST = (1.0,) * len(Channel)
"""How far each channel is sent at most, part of its window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close the whole hand and open it, again and again."""
    recorder.begin({"cycles": CYCLES, "half_s": HALF_S})
    driver = Sampler(target, recorder, progress, HALF_S * (1 + 2 * CYCLES))
    opened = np.zeros(len(Channel))
    driver.hold(opened, HALF_S, "open hand")
    for i in range(CYCLES):
        driver.hold(MAX_CODE * np.array(FURTHEST), HALF_S, f"cycle {i + 1} of {CYCLES}")
        driver.hold(opened, HALF_S, f"cycle {i + 1} of {CYCLES}")


def measure(recording: Recording) -> Measured:
    """Return by how much each channel's range (% of the window) and closing current (A) changed over the cycles."""
    codes, commands, currents = (recording[name] for name in ("codes", "command_codes", "currents"))
    pull = closing_current(currents.values, recording.header.hand)
    steps = find_steps(commands.times, commands.values)
    closings, openings = (sorted({s.start for s in steps if (s.after > s.before) is way}) for way in (True, False))
    require(len(openings) > 1 and len(closings) >= len(openings), "two cycles")
    opened = [last_before(codes.times, codes.values, start) for start in closings[: len(openings)]]
    closed = [last_before(codes.times, codes.values, start) for start in openings]
    ranges = (np.array(closed) - np.array(opened)) * 100.0 / MAX_CODE
    held = np.array([last_before(currents.times, pull, start) for start in openings])
    few = max(1, round(ENDS * len(openings)))
    drifts = [np.median(of[-few:], axis=0) - np.median(of[:few], axis=0) for of in (ranges, held)]
    return {
        channel.label: {"range_drift": float(drifts[0][channel]), "current_drift": float(drifts[1][channel])}
        for channel in Channel
    }
