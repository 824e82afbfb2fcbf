"""Discrete-event core: the only owner of time on the emulated side.

Theory of operation. Work is a callback at a time (`call_at`) or a task (`spawn`): a generator that reads top to bottom
like a FreeRTOS task and yields what it waits for,

- a float: until that time, s; `TASK_YIELD`, like any time that is past, lets everything that is due at this instant
  run first;
- a `Signal`: until it fires;
- a `(Signal, deadline)` pair: until it fires or the time (s) is reached; the yield evaluates to whether it fired.

Events of the same instant run in the order in which they were scheduled, so a run is a pure function of its inputs.
Where nothing else is due until the time that a task waits for, the task continues at once, without the queue: the same
order at a third of the cost (`pass_until`).
Only the owner of the clock calls `run_until`: `VirtualClock`, the driver's read in `links/in_process.py`, the loop of
`links/pty.py` that follows the wall clock, the comparison of two boards in `compare/run.py` and a firmware program
that homes in `native/program_board.py`. Callbacks and tasks never do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from heapq import heappop, heappush
from typing import Any


class Signal:
    """Something that tasks wait for; firing wakes all that wait at that moment."""

    __slots__ = ("_kernel", "_waiting")

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel
        self._waiting: list[tuple[Runner, int]] = []

    def fire(self) -> None:
        """Wake every waiting task at the present instant, in the order in which they began to wait."""
        if not self._waiting:
            return
        waiting, self._waiting = self._waiting, []
        kernel = self._kernel
        # What is woken here is in the middle of an event of another, for which no time may pass.
        last, kernel.last_of_event = kernel.last_of_event, False
        for runner, ticket in waiting:
            runner.wake(ticket, True)
        kernel.last_of_event = last

    def _add(self, runner: Runner, ticket: int) -> None:
        self._waiting = [entry for entry in self._waiting if entry[0].ticket == entry[1]]
        self._waiting.append((runner, ticket))


TASK_YIELD = 0.0
"""A time that is past: a task that waits for it runs after everything else of this instant, as by `taskYIELD()`."""


def milliseconds(t: float) -> int:
    """Return a board's millisecond counter at time `t` (s): ticks are whole milliseconds of the kernel."""
    return math.floor(t * 1000.0 + 1e-6)


def ticks_later(t: float, ticks: int) -> float:
    """Return the time of the `ticks`-th tick after `t` (s), as FreeRTOS waits: between `ticks - 1` and `ticks` ms."""
    return (milliseconds(t) + ticks) / 1000.0


def on_grid(t: float) -> float:
    """Return a time (s) to the nanosecond, so that what happens on a tick is not a rounding error before it."""
    return round(t, 9)


Yielded = float | Signal | tuple[Signal, float]
Task = Generator[Yielded, Any, Any]
"""What `spawn` runs; sub-tasks are called with `yield from` and may return a value."""


class Runner:
    """One spawned task. A ticket is spent by each wait, so that a wake-up that came too late finds it gone."""

    __slots__ = ("_kernel", "_task", "ticket")

    def __init__(self, kernel: Kernel, task: Task) -> None:
        self._kernel = kernel
        self._task = task
        self.ticket = 0

    def wake(self, ticket: int, fired: bool) -> None:
        """Resume the task if it still waits with this ticket; `fired` is what its yield evaluates to."""
        if ticket != self.ticket:
            return
        kernel, sent = self._kernel, fired if ticket else None
        while True:
            self.ticket = ticket = ticket + 1
            try:
                wanted = self._task.send(sent)
            except StopIteration:
                return
            if isinstance(wanted, Signal):
                wanted._add(self, ticket)
                return
            if isinstance(wanted, tuple):
                signal, deadline = wanted
                signal._add(self, ticket)
                kernel.call_at(deadline, self._due, ticket)
                return
            if not kernel.pass_until(wanted):
                kernel.call_at(wanted, self._due, ticket)
                return
            sent = False

    def _due(self, ticket: int) -> None:
        """Resume the task at the time for which it waits, as the only thing that this event does."""
        kernel = self._kernel
        kernel.last_of_event = True
        self.wake(ticket, False)
        kernel.last_of_event = False

    def stop(self) -> None:
        """End the task where it waits."""
        self.ticket += 1
        self._task.close()


class Kernel:
    """A queue of events in time order."""

    def __init__(self) -> None:
        self.now = 0.0
        self._queue: list[tuple[float, int, Callable[..., None], tuple[Any, ...]]] = []
        self._scheduled = 0
        self._paused = False
        self._limit = 0.0
        """Time up to which it runs, s."""
        self.last_of_event = False
        """Whether nothing of the present event follows the task that is running."""

    def call_at(self, t: float, function: Callable[..., None], *arguments: object) -> None:
        """Call `function(*arguments)` at time `t` (s), at the present instant when `t` is past."""
        self._scheduled += 1
        heappush(self._queue, (t if t > self.now else self.now, self._scheduled, function, arguments))

    def spawn(self, task: Task) -> Runner:
        """Start a task at the present instant; the result can stop it."""
        runner = Runner(self, task)
        self.call_at(self.now, runner.wake, 0, True)
        return runner

    def next_event(self) -> float | None:
        """Return the time (s) of the next event, None when nothing is scheduled."""
        return self._queue[0][0] if self._queue else None

    def run_until(self, t: float) -> None:
        """Run events up to and including time `t` (s), or up to the event that calls `pause`."""
        queue = self._queue
        self._paused = self.last_of_event = False
        self._limit = t
        while queue and queue[0][0] <= t:
            when, _, function, arguments = heappop(queue)
            self.now = when
            function(*arguments)
            if self._paused:
                return
        self.now = max(self.now, t)

    def pass_until(self, t: float) -> bool:
        """Let time pass to `t` (s) within the running task if `is_free_until` it; return whether it did."""
        free = self.is_free_until(t)
        if free and t > self.now:
            self.now = t
        return free

    def is_free_until(self, t: float) -> bool:
        """Return whether the running task may act at once as it would at `t` (s): nothing else is due until then.

        What is due at `t` itself, at the present instant when `t` is past, was there before the task, and comes first.
        """
        if not self.last_of_event or self._paused or t > self._limit:
            return False
        queue = self._queue
        return not queue or queue[0][0] > (t if t > self.now else self.now)

    def pause(self) -> None:
        """Let `run_until` return after the present event, time standing where it is."""
        self._paused = True


class Mutex:
    """A lock between tasks, like the semaphore that guards the servo UART."""

    __slots__ = ("_released", "held")

    def __init__(self, kernel: Kernel) -> None:
        self._released = Signal(kernel)
        self.held = False

    def try_take(self) -> bool:
        """Take the lock if it is free; return whether it was."""
        if self.held:
            return False
        self.held = True
        return True

    def take(self) -> Task:
        """Take the lock, waiting for it as long as it needs (`yield from`)."""
        while self.held:
            yield self._released
        self.held = True

    def give(self) -> None:
        """Give the lock back and wake those who wait for it."""
        self.held = False
        self._released.fire()


class VirtualClock:
    """Owns time by running the kernel; has the shape of the driver's clock."""

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel

    def now(self) -> float:
        """Return the virtual time in s."""
        return self._kernel.now

    def sleep_until(self, t: float) -> None:
        """Run everything up to `t` (s); nothing happens when it is past."""
        if t > self._kernel.now:
            self._kernel.run_until(t)
