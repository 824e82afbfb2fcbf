"""Repeatability: spread of one posture after repeated closures, and drift of range and current.

Defined as in the paper. Runs only by name. Records `codes`, `command_codes`, `currents` and `temperatures`.
"""

from collections.abc import Sequence

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import LOOSE_GRASP, OPENED, Measured, Sampler, last_before, map_of, require
from hil.checks.shared.signals import MILLI, closing_current, find_steps
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

CLOSURES = 10
HOLD_S = 1.2
"""Time open and closed, s; firmware `pre` moves for 0.6 s, and the hand then creeps in friction."""
FURTHEST = LOOSE_GRASP
"""Largest commanded fraction of each channel's window, command order."""
ENDS = 0.1
"""Fraction of the closures at the start and at the end whose medians are compared."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close the open hand to the loose grasp repeatedly."""
    close_again(target, recorder, progress, posture=FURTHEST, closures=CLOSURES, hold_s=HOLD_S)


def close_again(
    target: Target, recorder: Recorder, progress: Progress, *, posture: Sequence[float], closures: int, hold_s: float
) -> None:
    """Close the open hand to a posture, (7,) fractions of the window, and open it, `hold_s` at either end."""
    recorder.begin({"closures": closures, "hold_s": hold_s})
    driver = Sampler(target, recorder, progress, hold_s * (1 + 2 * closures))
    driver.hold(OPENED, hold_s, "open hand")
    for i in range(closures):
        driver.hold(MAX_CODE * np.array(posture), hold_s, f"closure {i + 1} of {closures}")
        driver.hold(OPENED, hold_s, f"closure {i + 1} of {closures}")


def measure(recording: Recording) -> Measured:
    """Return each channel's spread of closed positions (mm of cable, mrad) and drift of range and current.

    Range in % of the window, current in A (positive closes); both drifts are last minus first closures.
    """
    codes, commands, currents = (recording[name] for name in ("codes", "command_codes", "currents"))
    codec = map_of(recording.header)
    pull = closing_current(currents.values, recording.header.side)
    steps = find_steps(commands.times, commands.values)
    closings, openings = (sorted({s.start for s in steps if (s.after > s.before) is way}) for way in (True, False))
    require(len(openings) > 1 and len(closings) >= len(openings), "two closures")
    opened = np.array([last_before(codes.times, codes.values, start) for start in closings[: len(openings)]])
    closed = np.array([last_before(codes.times, codes.values, start) for start in openings])
    spread = np.ptp(codec.travel_from_angles(codec.angles_from_codes(closed.astype(int))), axis=0)
    held = np.array([last_before(currents.times, pull, start) for start in openings])
    few = max(1, round(ENDS * len(openings)))
    drift = [
        np.median(of[-few:], axis=0) - np.median(of[:few], axis=0)
        for of in ((closed - opened) * 100.0 / MAX_CODE, held)
    ]
    return {
        channel.label: {
            "closure_spread": MILLI * float(spread[channel]),
            "range_drift": float(drift[0][channel]),
            "current_drift": float(drift[1][channel]),
        }
        for channel in Channel
    }
