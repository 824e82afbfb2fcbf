"""Host scheduling delays of this program's loop and of an emulated board's loop.

Delays occur in real time only, never on virtual time. Waiting for a reply of the hand does not count as a delay.
"""

from __future__ import annotations

import os
import time
from collections import deque
from contextlib import suppress
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from aero.clock import WallClock
from aero.transport import Transport
from hil.targets.passing import Passing

LEAST_S = 0.005
"""Threshold of a delay, s; below it the delay is ignored. An idle computer wakes a program within 0.2 ms."""
LATE = "late"
"""First word of the line in which the process of an emulated board reports a delay, s."""
STORED = 100_000
"""Limit of delays in memory."""
_SCHEDSTAT = "/proc/thread-self/schedstat"
"""Linux scheduler statistics of the thread: run time, wait time (both ns), number of time slices."""


class Loop(Enum):
    """Delayed loop; the value is its column in a recording."""

    PROGRAM = "program"
    """This program, which drives the hand."""
    BOARD = "board"
    """The process that emulates the board."""


class Delay(NamedTuple):
    """Scheduling delay of a loop, from `t - by_s` to `t`."""

    t: float
    """Time of resumption, s on the clock of the target, or since the start of the recording."""
    by_s: float
    loop: Loop


class Waits(NamedTuple):
    """Waiting time of this thread since an arbitrary start."""

    seconds: float
    """Time asleep, neither running nor runnable, s."""
    disk_reads: int

    @classmethod
    def now(cls) -> Waits | None:
        """Return the present values, or None outside Linux."""
        try:
            queued_s = int(Path(_SCHEDSTAT).read_text(encoding="ascii").split()[1]) / 1e9
        except OSError:
            return None
        import resource  # noqa: PLC0415 - not on Windows

        disk_reads = resource.getrusage(resource.RUSAGE_SELF).ru_inblock
        return cls(time.perf_counter() - time.thread_time() - queued_s, disk_reads)


class DelayLog:
    """Delays of both loops since a target was opened; thread-safe for one writer a loop."""

    def __init__(self) -> None:
        self._clock = WallClock()
        self._noted: deque[Delay] = deque(maxlen=STORED)

    def add(self, by_s: float, loop: Loop) -> None:
        """Record a delay of a loop that ends now, if it reaches `LEAST_S`."""
        if by_s >= LEAST_S:
            self._noted.append(Delay(self._clock.now(), by_s, loop))

    def since(self, start: float) -> tuple[Delay, ...]:
        """Return the delays that ended after `start` (s on the clock), in order, with times relative to `start`."""
        late = sorted((delay for delay in list(self._noted) if delay.t >= start), key=lambda delay: delay.t)
        return tuple(delay._replace(t=delay.t - start) for delay in late)


LOOK_BACK_S = 3.0
"""Window of delays that may explain a missing reply, s: the longest time of retries before a hand is given up."""
NOTEWORTHY_S = 0.1
"""Threshold of delay within the window, s; above it a hand may look silent. Source: time-out of a reply."""


TRIES = 3
"""Attempts at a first reading on a delayed host."""


def held_up(log: DelayLog) -> str:
    """Return a sentence on recent host delays, to precede an error about the hand; empty below `NOTEWORTHY_S`."""
    late = log.since(WallClock().now() - LOOK_BACK_S)
    if (total := sum(delay.by_s for delay in late)) < NOTEWORTHY_S:
        return ""
    return (
        f"this computer was held up for {total:.1f} s in the last {LOOK_BACK_S:g} s, which may be the only cause: "
        "stop other programs and try again. Otherwise: "
    )


class TimedClock(WallClock):
    """Wall clock of a program's loop that logs the loop's delays."""

    def __init__(self, log: DelayLog) -> None:
        """Start to measure the delays of the calling thread."""
        self.log = log
        self._descriptor: int | None = None
        with suppress(OSError):  # not Linux, or without these statistics
            self._descriptor = os.open(_SCHEDSTAT, os.O_RDONLY)
        self._queued_s = self._read_queued()

    def sleep_until(self, t: float) -> None:
        """Sleep until the time is `t` (s)."""
        due = max(t, self.now())
        super().sleep_until(t)
        self.note(self.now() - due)

    def note(self, overslept_s: float = 0.0) -> None:
        """Record the delay since the last call: the scheduler's, or `overslept_s` if longer."""
        # Scheduler statistics, because the arrival time of awaited bytes is unknown, so an oversleep cannot be timed.
        queued = self._read_queued()
        held_up, self._queued_s = queued - self._queued_s, queued
        self.log.add(max(held_up, overslept_s), Loop.PROGRAM)

    def close(self) -> None:
        """Close the scheduler statistics."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def _read_queued(self) -> float:
        """Return the thread's total wait for a core, s; zero if unknown."""
        if self._descriptor is None:
            return 0.0
        return int(os.pread(self._descriptor, 64, 0).split()[1]) / 1e9


class TimedTransport(Passing):
    """Transport that records delays at every call."""

    def __init__(self, behind: Transport, clock: TimedClock) -> None:
        super().__init__(behind)
        self._timed = clock

    def write(self, data: bytes) -> None:
        """Send all of `data`."""
        super().write(data)
        self._timed.note()

    def read(self, size: int, timeout: float) -> bytes:
        """Read from the wrapped transport."""
        data = super().read(size, timeout)
        if timeout > 0.0:  # a read without waiting leaves the accounting to the next call
            self._timed.note()
        return data
