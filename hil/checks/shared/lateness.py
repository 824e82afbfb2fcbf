"""When this computer, or an emulated board on it, was held up: as its loops noted, and as the times of bytes tell."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from aero.protocol import FRAME_SIZE
from hil.checks.shared.exchanges import UNANSWERED, exchanges
from hil.recordings.recording import Recording
from hil.targets.delays import Delay, Loop
from hil.targets.wire_log import WireRecord

LATE_S = 0.015
"""Time that a computer may be late, s: desktops without a real-time kernel are by up to 10 ms. Beyond it a reading that
is a time does not stand."""
VERY_LATE_S = 0.2
"""Time from which on no reading stands, s: a hand that is held for half a second may not have come to rest."""
OFTEN, THROUGHOUT = 0.01, 0.02
"""Parts of a recording in which the program was held up: from the first on a time that is out of limits does not stand,
from the second on none does. Beside four busy processes 0.02 to 0.5, on an idle computer 0."""
LEAST_SAMPLES = 10
"""Readings from which on a program has a rhythm."""
FEW = 0.02
"""Part of the replies that may come late and still be a computer's doing: a link or a board is late more often."""
BUSY = 3
"""Delays of the program beyond `LATE_S`, as its loop noted them, from which on any number of late replies is the
computer's doing: an emulated board runs on it too."""


def held_up(recording: Recording, period_s: float) -> tuple[Delay, ...]:
    """Return when a recording shows that nothing was done for longer than `LATE_S` although it was due.

    Args:
        recording: of an experiment that reads its encoders regularly.
        period_s: planned time from one of these readings to the next, s.
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
    """Return the part of a recording in which the program's loop was held up, by however little each time."""
    held_up_s = sum(delay.by_s for delay in recording.delays if delay.loop is Loop.PROGRAM)
    return held_up_s / recording.header.duration_s if held_up_s else 0.0


def _gaps(wire: Sequence[WireRecord]) -> tuple[list[Delay], list[Delay]]:
    """Return the stretches between exchanges, in which the program does as it pleases, and those of the exchanges."""
    made = exchanges(wire)
    idle = list[Delay]()
    for one, following in pairwise(made):
        over = one.times[-1:] or [one.t] * (one.opcode in UNANSWERED)
        # After bytes that nobody asked for, the driver waits until the line is quiet.
        if over and len(one.received) <= FRAME_SIZE:
            idle.append(Delay(following.t, following.t - over[0], Loop.PROGRAM))
    asked = (one for one in made if one.times and one.opcode not in UNANSWERED)
    return idle, [Delay(one.times[0], one.times[0] - one.t, Loop.BOARD) for one in asked]


def longest(delays: Iterable[Delay], start: float, end: float) -> float:
    """Return the longest of the delays that touch a time from `start` to `end`, s; 0 without any."""
    return max((one.by_s for one in delays if one.t - one.by_s < end and one.t > start), default=0.0)
