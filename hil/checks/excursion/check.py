"""Excursion: range and stop current of each channel alone, and travel of the whole hand from open to fist.

The full code range is commanded regardless of the map, so the end stops show the true position of the command window.
As in the paper's kinematic validation, the fist is compared with the simulator under equal commands. Records `codes`,
`command_codes`, `currents` and `temperatures`.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.channels import FINGERS, Channel
from aero.protocol import MAX_CODE
from aero.side import Side
from hil.checks.shared.experiment import OPENED, Measured, Sampler, last_before, map_of, one_closed, require
from hil.checks.shared.signals import MILLI, closing_current, find_steps
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target
from simulator.routed import RoutedHand

HOLD_S = 0.9
"""Time at either end, s; a finger of firmware `pre` needs 0.7 s for its range."""
REST_S = 0.2
"""Final part of `HOLD_S`, s, in which a channel has reached its stop."""
FURTHEST = (1.0,) * 7
"""Largest commanded fraction of each channel's window, command order."""
FIST = np.zeros((2, len(Channel)), np.uint16)
"""Codes of a fist, (2, 7): fingers first, then the thumb over them.

If all closed together, the thumb would reach the palm before a slow finger and stop the finger.
"""
FIST[0, list(FINGERS)] = MAX_CODE
FIST[1] = MAX_CODE
SETTLE_S = 2.0
"""Settling time of the simulator, s."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close and open each channel alone, then close all to a fist."""
    recorder.begin({"hold_s": HOLD_S})
    driver = Sampler(target, recorder, progress, HOLD_S * (2 + len(FIST) + 2 * len(Channel)))
    driver.hold(OPENED, HOLD_S, "open hand")
    for channel in Channel:
        driver.hold(one_closed(channel, 1.0), HOLD_S, channel.label)
        driver.hold(OPENED, HOLD_S, channel.label)
    for codes in FIST:
        driver.hold(codes, HOLD_S, "fist")
    driver.hold(OPENED, HOLD_S, "open hand")


@cache
def simulated_fist(firmware: str, window: str, side: Side) -> NDArray[np.float64]:
    """Return the simulator's sensor change from open to fist, (7,) float, m and rad, positive closes.

    The simulator gets the codes converted to lengths by the map for this firmware, window and side, clipped to the
    actuator ranges.
    """
    codec, simulator = ActuationMap.for_firmware(firmware, window, side=side), RoutedHand(side)
    stages = codec.lengths_from_codes(np.vstack([np.zeros((1, len(Channel)), np.uint16), FIST]))
    reached = []
    for lengths in np.clip(stages, *simulator.command_range.T):
        simulator.command(lengths)
        simulator.advance(SETTLE_S)
        reached.append(simulator.lengths())
    closing = np.where(np.arange(len(Channel)) == Channel.THUMB_ABDUCTION, 1.0, -1.0)
    return closing * (reached[-1] - reached[0])


def measure(recording: Recording) -> Measured:
    """Return each channel's stop and stop current, and its fist travel against the simulator's."""
    codes, commands, currents = (recording[name] for name in ("codes", "command_codes", "currents"))
    codec = map_of(recording.header)
    pull = closing_current(currents.values, recording.header.side)
    steps = find_steps(commands.times, commands.values)
    require(len(steps) > 2 * len(Channel), "closings")
    fist = [step for step in steps[2 * len(Channel) :] if step.after > step.before]
    require(bool(fist), "a fist")
    ends = np.array([last_before(codes.times, codes.values, t) for t in (fist[0].start, fist[-1].end)])
    fist_travel = np.diff(codec.travel_from_angles(codec.angles_from_codes(ends.astype(np.int64))), axis=0)[0]
    header = recording.header
    model_travel = simulated_fist(header.firmware, header.window, header.side)
    found: dict[str, dict[str, float]] = {}
    for step in steps[: 2 * len(Channel) : 2]:
        closed = last_before(codes.times, codes.values, step.end).astype(int)
        found[Channel(step.channel).label] = {
            "closed_percent": 100.0 * float(closed[step.channel]) / MAX_CODE,
            "fist_travel": MILLI * float(fist_travel[step.channel]),
            "fist_difference": MILLI * abs(float(model_travel[step.channel] - fist_travel[step.channel])),
        }
        # with a late host, the last sample may precede the stop
        if currents.times[currents.times < step.end].max(initial=0.0) > step.end - REST_S:
            found[Channel(step.channel).label]["stop_current"] = float(
                last_before(currents.times, pull, step.end)[step.channel]
            )
    return found
