"""Holding: currents of a half-closed hand at rest.

Records `codes`, `command_codes`, `currents` and `temperatures`.
"""

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import LOOSE_GRASP, OPENED, Measured, Sampler, require
from hil.checks.shared.signals import closing_current
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

OPEN_S, HOLD_S = 1.0, 8.0
FURTHEST = LOOSE_GRASP
"""Largest commanded fraction of each channel's window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Hold the open hand, a loose grasp, and the open hand again."""
    recorder.begin({"open_s": OPEN_S, "hold_s": HOLD_S})
    driver = Sampler(target, recorder, progress, 2 * OPEN_S + HOLD_S)
    driver.hold(OPENED, OPEN_S, "open hand")
    driver.hold(MAX_CODE * np.array(LOOSE_GRASP), HOLD_S, "holding")
    driver.hold(OPENED, OPEN_S, "open hand")


def measure(recording: Recording) -> Measured:
    """Return each channel's holding current (A, positive closes) and position drift (% of the window)."""
    currents, codes = (recording[name] for name in ("currents", "codes"))
    pull = closing_current(currents.values, recording.header.side)
    held = (currents.times > OPEN_S + 1.0) & (currents.times < OPEN_S + HOLD_S)
    still = (codes.times > OPEN_S + 1.0) & (codes.times < OPEN_S + HOLD_S)
    require(bool(held.any() and still.any()), "samples of the hand that holds")
    return {
        channel.label: {
            "holding_current": float(np.median(pull[held, channel])),
            "creep_percent": 100.0 * float(np.ptp(codes.values[still, channel])) / MAX_CODE,
        }
        for channel in Channel
    }
