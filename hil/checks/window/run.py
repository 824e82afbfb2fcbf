"""Window: how much of each command window lies beyond the channel's travel, at its open and at its closed end.

Each cable is wound slowly from the open hand, and each finger then closed to its stop. A trim by zero degrees asks the
board where a window begins and, with firmware `main`, where the servo stands; it changes nothing. Asked for by name
only. Leaves `codes`, `command_codes` and `currents`.
"""

from __future__ import annotations

import numpy as np

from aero.channels import CABLES, FINGERS, Channel
from hil.checks.shared.experiment import SAMPLE_S, Sampler, one_closed
from hil.recordings.recorder import Progress, Recorder
from hil.targets.target import Target

WOUND = 0.35
"""How far a cable is wound slowly, part of the window: a third of a finger's travel."""
WIND_S, HOLD_S = 3.5, 0.9
"""Time to wind it, and at either end, s."""
FURTHEST = tuple(1.0 if channel in FINGERS else WOUND for channel in Channel)
"""How far each channel is sent at most, part of its window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Wind each cable slowly, close each finger, and ask the board about each window."""
    recorder.begin({"wind_s": WIND_S, "hold_s": HOLD_S})
    driver = Sampler(target, recorder, progress, HOLD_S + len(CABLES) * (WIND_S + 2 * HOLD_S))
    opened = np.zeros(len(Channel))
    driver.hold(opened, HOLD_S, "open hand")
    steps = round(WIND_S / SAMPLE_S)
    for channel in Channel:
        extend = target.hand.trim(channel, 0).extend_counts
        recorder.note_parameters(**{f"extend_{channel.label}": extend})
        driver.resume()
        if channel not in CABLES:
            continue
        for step in range(1, steps + 1):
            driver.hold(one_closed(channel, WOUND * step / steps), SAMPLE_S, channel.label)
        if channel in FINGERS:
            driver.hold(one_closed(channel, 1.0), HOLD_S, channel.label)
            at_stop = target.hand.trim(channel, 0).position_counts
            recorder.note_parameters(**{f"stop_{channel.label}": "" if at_stop is None else at_stop})
            driver.resume()
        driver.hold(opened, HOLD_S, channel.label)
