"""Holding currents, drift and warming of a hand that holds still."""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.holding.run import HOLD_S, OPEN_S
from hil.checks.shared.experiment import Measured
from hil.checks.shared.signals import closing_current
from hil.recordings.recording import Recording


def measure(recording: Recording) -> Measured:
    """Return each channel's holding current (A, positive closes), its drift, and its warming (degC)."""
    currents, temperatures, codes = (recording[name] for name in ("currents", "temperatures", "codes"))
    pull = closing_current(currents.values, recording.header.hand)
    held = (currents.times > OPEN_S + 1.0) & (currents.times < OPEN_S + HOLD_S)
    still = (codes.times > OPEN_S + 1.0) & (codes.times < OPEN_S + HOLD_S)
    return {
        channel.label: {
            "holding_current": float(np.median(pull[held, channel])),
            "creep_percent": 100.0 * float(np.ptp(codes.values[still, channel])) / MAX_CODE,
            "warming": float(temperatures.values[-1, channel] - temperatures.values[0, channel]),
        }
        for channel in Channel
    }
