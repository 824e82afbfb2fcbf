"""Delay, offset and difference in shape between hand and simulator."""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from hil.checks.replay.run import SETTLE_S
from hil.checks.shared.experiment import Measured
from hil.checks.shared.signals import at_times, display_unit, rms
from hil.recordings.recording import Recording

LONGEST_DELAY_S = 0.2


def measure(recording: Recording) -> Measured:
    """Return, by channel, the hand's delay against the simulator (ms) and their difference with and without it."""
    hand, model = recording["hand"], recording["model"]
    moving = hand.times > SETTLE_S + LONGEST_DELAY_S
    found = {}
    for channel in Channel:
        _, scale = display_unit(hand.units[channel])
        trace = scale * hand.values[moving, channel]
        delays = np.arange(-LONGEST_DELAY_S, LONGEST_DELAY_S, 0.005)
        errors = [
            trace - scale * at_times(model.times, model.values[:, [channel]], hand.times[moving] - delay)[:, 0]
            for delay in delays
        ]
        best = int(np.argmin([error.std() for error in errors]))
        zero = int(np.argmin(np.abs(delays)))
        found[channel.label] = {
            "replay_rms": rms(errors[zero]),
            "replay_delay": 1e3 * float(delays[best]),
            "replay_shape": float(errors[best].std()),
            "replay_offset": float(errors[best].mean()),
        }
    return found
