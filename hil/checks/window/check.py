"""Window: how much of each command window lies beyond the channel's travel, at its open and at its closed end.

Each cable is wound slowly from the open hand, and each finger then closed to its stop. A trim by zero degrees asks the
board where a window begins and, with firmware `main`, where the servo stands; it changes nothing. Asked for by name
only. Leaves `codes`, `command_codes` and `currents`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aero.channels import CABLES, FINGERS, Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import OPENED, SAMPLE_S, Measured, Sampler, map_of, one_closed
from hil.checks.shared.signals import closing_current
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

Floats = NDArray[np.float64]

WOUND = 0.35
"""How far a cable is wound slowly, part of the window: a third of a finger's travel."""
WIND_S, HOLD_S = 3.5, 0.9
"""Time to wind it, and at either end, s."""
FURTHEST = tuple(1.0 if channel in FINGERS else WOUND for channel in Channel)
"""How far each channel is sent at most, part of its window, command order."""
LOADED_A = 0.2
"""Median current that a wound cable draws at least, A; a spool alone draws 0.02 to 0.16, a finger 0.6."""
JUMP_A = 0.08
"""Least rise of the current where a cable begins to pull, A: the springs of a finger ask for 0.13 and more."""
PULLING = 0.5
"""Share of its last current from which on a cable pulls already: a slack one draws a quarter of it, a taut one half."""
BESIDE = 3
"""Readings on either side that a rise is taken between."""
TURN, HALF_TURN = 4096, 2048


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Wind each cable slowly, close each finger, and ask the board about each window."""
    recorder.begin({"wind_s": WIND_S, "hold_s": HOLD_S})
    driver = Sampler(target, recorder, progress, HOLD_S + len(CABLES) * (WIND_S + 2 * HOLD_S))
    driver.hold(OPENED, HOLD_S, "open hand")
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
        driver.hold(OPENED, HOLD_S, channel.label)


def measure(recording: Recording) -> Measured:
    """Return counts of slack at the open hand, counts between stop and closed end, and counts of trim."""
    codes, commands, currents = (recording[name] for name in ("codes", "command_codes", "currents"))
    header = recording.header
    window = map_of(header).window
    spans = window.spans_counts()
    pull = closing_current(currents.values, header.hand)
    extend, grasp = np.array(window.extend_counts), np.array(window.grasp_counts)
    opening = np.sign(extend - grasp)
    found: dict[str, dict[str, float]] = {channel.label: {} for channel in Channel}
    for channel in Channel:
        told = header.number(f"extend_{channel.label}")
        found[channel.label]["window_moved"] = float(opening[channel]) * (told - extend[channel])
        if channel not in CABLES:
            continue
        share = commands.values[:, channel] / MAX_CODE
        winding = (share > 0.0) & (share <= WOUND + 1e-3)
        begin, end = commands.times[winding][[0, -1]]
        during = (currents.times >= begin) & (currents.times <= end)
        wound = spans[channel] * np.interp(currents.times[during], codes.times, codes.values[:, channel]) / MAX_CODE
        found[channel.label]["slack"] = taken_up(wound, pull[during, channel])
        if channel in FINGERS:
            closed = codes.values[commands.values[:, channel] == MAX_CODE, channel][-1]
            left = spans[channel] * (1.0 - closed / MAX_CODE)
            if header.parameters.get(f"stop_{channel.label}", "") != "":
                # Beyond the closed end the reading does not change there, while the servo's own count does.
                beyond = (
                    opening[channel] * (header.number(f"stop_{channel.label}") - grasp[channel]) + HALF_TURN
                ) % TURN - HALF_TURN
                left = float(beyond)
            found[channel.label]["left_closed"] = float(left)
    return found


def taken_up(wound: Floats, pull: Floats) -> float:
    """Return how far a cable was wound (counts) when it began to pull; 0 from the start on, NaN when it never did.

    Args:
        wound: (n,) counts, rising.
        pull: (n,) A, positive closes.
    """
    if float(np.median(pull[-BESIDE:])) < LOADED_A:
        return np.nan
    rows = np.arange(BESIDE, len(pull) - BESIDE + 1)
    before = np.array([np.median(pull[row - BESIDE : row]) for row in rows])
    rise = np.array([np.median(pull[row : row + BESIDE]) for row in rows]) - before
    # A taut cable has its steepest rise anywhere: the load of its springs grows all the way.
    rise[before > PULLING * np.median(pull[-BESIDE:])] = 0.0
    steepest = int(np.argmax(rise))
    return float(wound[rows[steepest]]) if rise[steepest] >= JUMP_A else 0.0
