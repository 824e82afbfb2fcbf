"""When this computer, or what answers for the board, was held up in a recording, told from the times of its bytes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from aero.protocol import Opcode
from hil.recordings.recording import Recording
from hil.targets.wire_log import WireRecord

LATE_S = 0.015
"""Time that a computer may be late, s: desktops without a real-time kernel are by up to 10 ms. Beyond it a reading that
is a time does not stand."""
VERY_LATE_S = 0.2
"""Time from which on no reading stands, s: a hand that is held for half a second may not have come to rest."""
LEAST_SAMPLES = 10
"""Readings from which on a program has a rhythm."""
FEW = 0.02
"""Part of the replies that may come late and still be a computer's doing: a link or a board is late more often."""
SILENT = {Opcode.CTRL_POS, Opcode.CTRL_TOR}
"""Requests that are not answered."""


@dataclass(frozen=True)
class HeldUp:
    """A stretch in which nothing was done that was due."""

    start: float
    """s since the start of the recording."""
    end: float

    @property
    def seconds(self) -> float:
        """How long."""
        return self.end - self.start


def held_up(recording: Recording, period_s: float) -> tuple[HeldUp, ...]:
    """Return when a recording shows that nothing was done for longer than `LATE_S` although it was due.

    Args:
        recording: of an experiment that reads its encoders regularly.
        period_s: planned time from one of these readings to the next, s.
    """
    idle, trips = _gaps(recording.wire)
    times = recording["codes"].times
    if not idle or len(times) < LEAST_SAMPLES:
        return ()
    starts, ends = (np.array([getattr(gap, name) for gap in idle]) for name in ("start", "end"))
    edges = np.stack([starts, ends], axis=1).ravel()
    spent = np.repeat(np.append(0.0, np.cumsum(ends - starts)), 2)[1:-1]
    free = np.diff(np.interp(times, edges, spent)) - period_s
    found = [HeldUp(float(times[i + 1] - free[i]), float(times[i + 1])) for i in np.flatnonzero(free > LATE_S)]
    slow = [trip for trip in trips if trip.seconds > LATE_S + period_s]
    if len(slow) <= FEW * len(trips):
        found += slow
    return tuple(sorted(found, key=lambda one: one.start))


def _gaps(wire: Sequence[WireRecord]) -> tuple[list[HeldUp], list[HeldUp]]:
    """Return the stretches between exchanges, in which the program does as it pleases, and those of the exchanges."""
    idle, trips = list[HeldUp](), list[HeldUp]()
    for before, record in zip(wire, wire[1:], strict=False):
        asked = before.direction == "to_hand" and before.data[0] not in SILENT
        gap = HeldUp(before.t, record.t)
        if record.direction == "to_hand" and not asked:
            idle.append(gap)
        elif record.direction == "from_hand" and asked:
            trips.append(gap)
    return idle, trips


def longest(stretches: Iterable[HeldUp], start: float, end: float) -> float:
    """Return the longest of the stretches that touch a time from `start` to `end`, s; 0 without any."""
    return max((one.seconds for one in stretches if one.start < end and one.end > start), default=0.0)
