"""How late this program's loop, or the loop of an emulated board, was because its computer did something else.

Only in real time: on virtual time nothing is late. A program that waits for an answer of the hand is not late.
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
from hil.faults.host import Passing

LEAST_S = 0.005
"""Delay below this is not noted, s; an idle computer wakes a program within 0.2 ms."""
LATE = "late"
"""First word of the line in which the process of an emulated board says how late it was, s."""
STORED = 100_000
"""Last ones that are stored."""
_SCHEDSTAT = "/proc/thread-self/schedstat"
"""Of Linux: time on a core, time in which the thread could have run and did not, both ns, and how often it ran."""


class Loop(Enum):
    """Whose loop was late; the value is its name in a recording."""

    PROGRAM = "program"
    """This program, which drives the hand."""
    BOARD = "board"
    """The process that emulates the board."""


class Delay(NamedTuple):
    """One delay."""

    t: float
    """When the loop resumed, s on the clock of the target, or since the start of the recording."""
    by_s: float
    """How long it was held up, s; so it began at `t - by_s`."""
    loop: Loop


class Waits(NamedTuple):
    """Waiting of this thread since an arbitrary start."""

    seconds: float
    """Time in which this thread neither ran nor could have run, s."""
    disk_reads: int
    """Reads that waited for a disk."""

    @classmethod
    def now(cls) -> Waits | None:
        """Return the present values; None where the system does not count them (Linux does)."""
        try:
            queued_s = int(Path(_SCHEDSTAT).read_text(encoding="ascii").split()[1]) / 1e9
        except OSError:
            return None
        import resource  # noqa: PLC0415 - not on Windows

        disk_reads = resource.getrusage(resource.RUSAGE_SELF).ru_inblock
        return cls(time.perf_counter() - time.thread_time() - queued_s, disk_reads)


class DelayLog:
    """The delays of both loops since a target was opened; each may be added by a thread of its own."""

    def __init__(self) -> None:
        self._clock = WallClock()
        self._noted: deque[Delay] = deque(maxlen=STORED)

    def add(self, by_s: float, loop: Loop) -> None:
        """Note that a loop has been held up until now, unless that is too short to matter."""
        if by_s >= LEAST_S:
            self._noted.append(Delay(self._clock.now(), by_s, loop))

    def since(self, start: float) -> tuple[Delay, ...]:
        """Return the delays that ended after `start` (s on the clock), in order and with times relative to it."""
        late = sorted((delay for delay in list(self._noted) if delay.t >= start), key=lambda delay: delay.t)
        return tuple(delay._replace(t=delay.t - start) for delay in late)


LOOK_BACK_S = 3.0
"""A hand is asked again and again for at most this long before it is given up, s."""
NOTEWORTHY_S = 0.1
"""Time held up, s, that can make a hand look silent: a reply is waited for as long."""


TRIES = 3
"""How often a hand is asked for its first reading while this computer is held up."""


def held_up(log: DelayLog) -> str:
    """Return, in words to put before what a hand is blamed for, that the computer was busy; empty where it was not."""
    late = log.since(WallClock().now() - LOOK_BACK_S)
    if (total := sum(delay.by_s for delay in late)) < NOTEWORTHY_S:
        return ""
    return (
        f"this computer was held up for {total:.1f} s in the last {LOOK_BACK_S:g} s, which may be all that is wrong: "
        "end what else runs here and try again. Otherwise: "
    )


class TimedClock(WallClock):
    """The wall clock of a program's loop; how much too late a wait ended goes to a log."""

    def __init__(self, log: DelayLog) -> None:
        """Time the thread that makes this."""
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
        """Note how long this program could not run since the last call, at least `overslept_s`."""
        # What the scheduler says counts as well: who waits for bytes does not know when they were there.
        queued = self._read_queued()
        held_up, self._queued_s = queued - self._queued_s, queued
        self.log.add(max(held_up, overslept_s), Loop.PROGRAM)

    def close(self) -> None:
        """Let go of the system's statistics."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def _read_queued(self) -> float:
        """Return for how long the thread has waited for a core since it started, s; zero where that is not known."""
        if self._descriptor is None:
            return 0.0
        return int(os.pread(self._descriptor, 64, 0).split()[1]) / 1e9


class TimedTransport(Passing):
    """A transport whose calls a clock times."""

    def __init__(self, behind: Transport, clock: TimedClock) -> None:
        super().__init__(behind)
        self._timed = clock

    def write(self, data: bytes) -> None:
        """Send all of `data`."""
        super().write(data)
        self._timed.note()

    def read(self, size: int, timeout: float) -> bytes:
        """Read as the transport behind does."""
        data = super().read(size, timeout)
        if timeout > 0.0:  # one that does not wait leaves it to the next call
            self._timed.note()
        return data
