"""Window: margin of each command window beyond the channel's travel at the open and closed end.

Each cable is wound slowly from the open hand, then each finger is closed to its stop. A trim by zero degrees reads the
window's origin and, with firmware `main`, the servo's position; it changes nothing. Runs only by name. Records `codes`,
`command_codes` and `currents`.
"""

import numpy as np

from aero.channels import CABLES, FINGERS, Channel
from aero.floats import Floats
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import OPENED, SAMPLE_S, Measured, Sampler, map_of, one_closed
from hil.checks.shared.signals import closing_current
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

WOUND = 0.35
"""Slow part of the winding, fraction of the window; a third of a finger's travel."""
WIND_S, HOLD_S = 3.5, 0.9
"""Winding time, and time at either end, s."""
FURTHEST = tuple(1.0 if channel in FINGERS else WOUND for channel in Channel)
"""Largest commanded fraction of each channel's window, command order."""
LOADED_A = 0.2
"""Threshold of the median current of a wound cable, A; below it the cable carries no load.

A spool alone draws 0.02 to 0.16 A, a finger 0.6 A.
"""
JUMP_A = 0.08
"""Threshold of the current rise, A, at which a cable starts to pull; a finger's springs need 0.13 A or more."""
PULLING = 0.5
"""Threshold relative to the final current; above it a cable already pulls. Slack cables: a quarter; taut: half."""
BESIDE = 3
"""Number of readings on either side of a rise."""
TURN, HALF_TURN = 4096, 2048


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Wind each cable slowly, close each finger, and query each window from the board."""
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
    """Return slack at the open hand, distance from stop to closed end, and trim, all in counts."""
    codes, commands, currents = (recording[name] for name in ("codes", "command_codes", "currents"))
    header = recording.header
    window = map_of(header).window
    spans = window.spans_counts()
    pull = closing_current(currents.values, header.side)
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
                # beyond the closed end the reading saturates, while the servo's own count continues
                beyond = (
                    opening[channel] * (header.number(f"stop_{channel.label}") - grasp[channel]) + HALF_TURN
                ) % TURN - HALF_TURN
                left = float(beyond)
            found[channel.label]["left_closed"] = float(left)
    return found


def taken_up(wound: Floats, pull: Floats) -> float:
    """Return the wound length (counts) at which a cable began to pull; 0 if taut from the start, NaN if it never did.

    Args:
        wound: (n,) counts, rising.
        pull: (n,) A, positive closes.
    """
    if float(np.median(pull[-BESIDE:])) < LOADED_A:
        return np.nan
    rows = np.arange(BESIDE, len(pull) - BESIDE + 1)
    before = np.array([np.median(pull[row - BESIDE : row]) for row in rows])
    rise = np.array([np.median(pull[row : row + BESIDE]) for row in rows]) - before
    # a taut cable can have its steepest rise anywhere, because its spring load grows all the way
    rise[before > PULLING * np.median(pull[-BESIDE:])] = 0.0
    steepest = int(np.argmax(rise))
    return float(wound[rows[steepest]]) if rise[steepest] >= JUMP_A else 0.0
