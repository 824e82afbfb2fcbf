"""Delays of this computer, or of an emulated board on it, from loop records and from the times of bytes."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from aero.protocol import FRAME_SIZE
from hil.checks.shared.exchanges import UNANSWERED, exchanges
from hil.recordings.recording import Recording
from hil.targets.delays import Delay, Loop
from hil.targets.wire_log import WireRecord

LATE_S = 0.015
"""Threshold of a delay, s; above it a reading of a time is not judged.

Desktops without a real-time kernel are late by up to 10 ms.
"""
VERY_LATE_S = 0.2
"""Threshold of a delay, s; above it no reading is judged: a hand held for half a second may not have settled."""
OFTEN, THROUGHOUT = 0.01, 0.02
"""Thresholds of the delayed fraction of a recording.

Above the first, times out of limits are not judged; above the second, no times. Beside four busy processes the fraction
is 0.02 to 0.5, on an idle computer 0.
"""
LEAST_SAMPLES = 10
"""Smallest number of encoder readings for detecting delays from their times."""
FEW = 0.02
"""Threshold of the fraction of late replies; above it they count as a fault of link or board, not of the computer."""
BUSY = 3
"""Threshold of the number of program delays above `LATE_S`; from it all late replies are attributed to the computer.

An emulated board runs on the busy computer too.
"""


def held_up(recording: Recording, period_s: float) -> tuple[Delay, ...]:
    """Return the stretches of a recording in which due work was delayed by more than `LATE_S`.

    Args:
        recording: recording with periodic encoder readings.
        period_s: planned period of the encoder readings, s.
    """
    idle, trips = _gaps(recording.wire)
    times = recording["codes"].times
    if not idle or len(times) < LEAST_SAMPLES:
        return recording.delays
    ends, lengths = (np.array(values) for values in zip(*((gap.t, gap.by_s) for gap in idle), strict=True))
    edges = np.stack([ends - lengths, ends], axis=1).ravel()
    spent = np.repeat(np.append(0.0, np.cumsum(lengths)), 2)[1:-1]
    free = np.diff(np.interp(times, edges, spent)) - period_s
    found = [delay for delay in recording.delays if delay.by_s > LATE_S]
    busy = sum(delay.loop is Loop.PROGRAM for delay in found) >= BUSY
    found += [Delay(float(times[i + 1]), float(free[i]), Loop.PROGRAM) for i in np.flatnonzero(free > LATE_S)]
    slow = [trip for trip in trips if trip.by_s > LATE_S + period_s]
    if len(slow) <= FEW * len(trips) or busy:
        found += slow
    return tuple(sorted(found))


def part_late(recording: Recording) -> float:
    """Return the fraction of a recording in which the program's loop was delayed, however briefly each time."""
    held_up_s = sum(delay.by_s for delay in recording.delays if delay.loop is Loop.PROGRAM)
    return held_up_s / recording.header.duration_s if held_up_s else 0.0


def _gaps(wire: Sequence[WireRecord]) -> tuple[list[Delay], list[Delay]]:
    """Return the gaps between exchanges, which the program controls, and the response times of the exchanges."""
    made = exchanges(wire)
    idle = list[Delay]()
    for one, following in pairwise(made):
        over = one.times[-1:] or [one.t] * (one.opcode in UNANSWERED)
        # after unsolicited bytes, the driver waits for a quiet line
        if over and len(one.received) <= FRAME_SIZE:
            idle.append(Delay(following.t, following.t - over[0], Loop.PROGRAM))
    asked = (one for one in made if one.times and one.opcode not in UNANSWERED)
    return idle, [Delay(one.times[0], one.times[0] - one.t, Loop.BOARD) for one in asked]


def longest(delays: Iterable[Delay], start: float, end: float) -> float:
    """Return the longest delay that overlaps the interval from `start` to `end`, s; 0 without any."""
    return max((one.by_s for one in delays if one.t - one.by_s < end and one.t > start), default=0.0)
