"""Discrete-event kernel: the only owner of time on the emulated side.

Theory of operation. Work is a callback at a time (`call_at`) or a task (`spawn`): a generator that reads top to bottom
like a FreeRTOS task and yields its wait condition,

- a float: wait until that time, s; `TASK_YIELD`, or any past time, first runs all other events due at this instant;
- a `Signal`: wait until the signal fires;
- a `(Signal, deadline)` pair: wait for the signal or the time (s); the yield evaluates to whether the signal fired.

Simultaneous events run in the order of scheduling, so a run is a pure function of its inputs. If no other event is due
before a task's wake-up time, the task continues at once without the queue: equal order at a third of the cost
(`pass_until`).
Only the owner of the clock calls `run_until`: `VirtualClock`, the driver's read in `links/in_process.py`, the loop of
`links/pty.py` that follows the wall clock, the comparison of two boards in `compare/run.py` and a firmware program
that homes in `native/program_board.py`. Callbacks and tasks never do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from heapq import heappop, heappush
from typing import Any

from firmware_emulator.held_signals import HeldSignals


class KernelLeftError(ConnectionError):
    """An exception has left an event incomplete; the tasks that it ran have ended, and the board answers no more."""

    def __init__(self) -> None:
        super().__init__("the emulated hand was interrupted in the middle of an event; open a new one")


class Signal:
    """Event for tasks to wait for; firing wakes all tasks waiting at that moment."""

    __slots__ = ("_kernel", "_waiting")

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel
        self._waiting: list[tuple[Runner, int]] = []

    def fire(self) -> None:
        """Wake every waiting task now, in the order in which the waits began."""
        if not self._waiting:
            return
        waiting, self._waiting = self._waiting, []
        kernel = self._kernel
        # The woken tasks run inside another task's event, during which time must not advance.
        last, kernel.last_of_event = kernel.last_of_event, False
        for runner, ticket in waiting:
            runner.wake(ticket, True)
        kernel.last_of_event = last

    def _add(self, runner: Runner, ticket: int) -> None:
        self._waiting = [entry for entry in self._waiting if entry[0].ticket == entry[1]]
        self._waiting.append((runner, ticket))


TASK_YIELD = 0.0
"""Past time, as a wait condition: run after all other events of this instant, as with `taskYIELD()`."""


def milliseconds(t: float) -> int:
    """Return the board's millisecond counter at time `t` (s); its ticks are whole milliseconds of the kernel."""
    return math.floor(t * 1000.0 + 1e-6)


def ticks_later(t: float, ticks: int) -> float:
    """Return the time (s) of the `ticks`-th tick after `t` (s): as in FreeRTOS, `ticks - 1` to `ticks` ms later."""
    return (milliseconds(t) + ticks) / 1000.0


def on_grid(t: float) -> float:
    """Round a time (s) to the nanosecond, so that a tick's events are never a rounding error early."""
    return round(t, 9)


# Generators, because a task then reads like the firmware's C++ and the kernel alone orders all events. Threads would
# run in the order of the system's scheduler, and asyncio's tasks would need `async` in every call below them.
Yielded = float | Signal | tuple[Signal, float]
Task = Generator[Yielded, Any, Any]
"""Argument of `spawn`; sub-tasks are called with `yield from` and may return a value."""


class Runner:
    """One spawned task. Each wait has its own ticket, so that a stale wake-up is ignored."""

    __slots__ = ("_kernel", "_task", "ticket")

    def __init__(self, kernel: Kernel, task: Task) -> None:
        self._kernel = kernel
        self._task = task
        self.ticket = 0

    def wake(self, ticket: int, fired: bool) -> None:
        """Resume the task if this ticket is current; its yield evaluates to `fired`."""
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
        """Resume the task at its wake-up time, as the only action of this event."""
        kernel = self._kernel
        kernel.last_of_event = True
        self.wake(ticket, False)
        kernel.last_of_event = False

    def stop(self) -> None:
        """Close the waiting task."""
        self.ticket += 1
        self._task.close()


class Kernel:
    """A queue of events in time order."""

    def __init__(self) -> None:
        self.now = 0.0
        self._queue: list[tuple[float, int, Callable[..., None], tuple[Any, ...]]] = []
        self._scheduled = 0
        self._paused = self._paused_by_event = False
        self.left = False
        """True once an exception has left an event incomplete."""
        self._limit = 0.0
        """End time of the present `run_until`, s."""
        self.last_of_event = False
        """True if the running task is the last action of the current event."""

    def call_at(self, t: float, function: Callable[..., None], *arguments: object) -> None:
        """Call `function(*arguments)` at time `t` (s), or now if `t` is past."""
        self._scheduled += 1
        heappush(self._queue, (t if t > self.now else self.now, self._scheduled, function, arguments))

    def spawn(self, task: Task) -> Runner:
        """Start a task now; return its runner, for stopping."""
        runner = Runner(self, task)
        self.call_at(self.now, runner.wake, 0, True)
        return runner

    def next_event(self) -> float | None:
        """Return the time (s) of the next event, or None if the queue is empty."""
        return self._queue[0][0] if self._queue else None

    def run_until(self, t: float) -> None:
        """Run all events up to and including time `t` (s), or until an event calls `pause`.

        Signals are held until the present event is complete.

        Raises:
            KernelLeftError: an exception has left an earlier event incomplete.
        """
        if self.left:
            raise KernelLeftError
        if not self._queue or self._queue[0][0] > t:
            # Half of all calls read only bytes that have arrived, and a hold costs more than the rest of such a call.
            self.now = max(self.now, t)
            return
        signalled, self._paused_by_event = True, False
        while signalled and not self._paused_by_event:
            self._paused = self.last_of_event = False
            held = HeldSignals(self._leave)
            try:
                held.hold()
                self._run(t)
            finally:
                signalled = held.release()

    def _run(self, t: float) -> None:
        queue, self._limit = self._queue, t
        try:
            while queue and queue[0][0] <= t:
                when, _, function, arguments = heappop(queue)
                self.now = when
                function(*arguments)
                if self._paused:
                    return
        except BaseException:
            self.left = True
            raise
        self.now = max(self.now, t)

    def _leave(self) -> None:
        """End the run after the present event, for a signal."""
        self._paused = True

    def pass_until(self, t: float) -> bool:
        """Advance time to `t` (s) within the running task if `is_free_until(t)`; return whether time was free."""
        free = self.is_free_until(t)
        if free and t > self.now:
            self.now = t
        return free

    def is_free_until(self, t: float) -> bool:
        """Return whether no other event is due until `t` (s), so that the running task may jump there at once.

        An event due exactly at `t` (or now, if `t` is past) was scheduled earlier and must run first.
        """
        if not self.last_of_event or self._paused or t > self._limit:
            return False
        queue = self._queue
        return not queue or queue[0][0] > (t if t > self.now else self.now)

    def pause(self) -> None:
        """Make `run_until` return after the present event, without advancing time further."""
        self._paused = self._paused_by_event = True


class Mutex:
    """Lock between tasks, like the semaphore of the servo UART."""

    __slots__ = ("_released", "held")

    def __init__(self, kernel: Kernel) -> None:
        self._released = Signal(kernel)
        self.held = False

    def try_take(self) -> bool:
        """Take the lock if it is free; return whether it was taken."""
        if self.held:
            return False
        self.held = True
        return True

    def take(self) -> Task:
        """Wait for the lock and take it (`yield from`)."""
        while self.held:
            yield self._released
        self.held = True

    def give(self) -> None:
        """Release the lock and wake the waiting tasks."""
        self.held = False
        self._released.fire()


class VirtualClock:
    """Clock that advances by running the kernel; implements the driver's clock interface."""

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel

    def now(self) -> float:
        """Return the virtual time in s."""
        return self._kernel.now

    def sleep_until(self, t: float) -> None:
        """Run all events up to `t` (s); a past time has no effect."""
        if t > self._kernel.now:
            self._kernel.run_until(t)
