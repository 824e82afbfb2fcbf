"""Deferring and handling of signals, so that a hand is never left closed."""

import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from types import FrameType
from typing import ClassVar, TypeVar

from aero.exit_code import STOPPING

Entered = TypeVar("Entered")
_UNWINDING = tuple(number for number in STOPPING if number != signal.SIGINT)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Defer signals that stop a program to the end of the block; no effect outside the main thread.

    Each signal is delivered once. If several raise, the last exception has the others as its context.
    """
    caught: list[int] = []
    try:
        with _handled(STOPPING, _into(caught)):
            yield
    finally:
        _deliver(caught)


@contextmanager
def noted(*numbers: signal.Signals) -> Iterator[list[int]]:
    """Yield a list of received signals, in place of their handlers, for a loop that polls it.

    The handlers are restored afterwards; outside the main thread the list remains empty.
    """
    caught: list[int] = []
    with _handled(numbers, _into(caught)):
        yield caught


@contextmanager
def unwinding() -> Iterator[None]:
    """Raise SystemExit on SIGTERM and SIGHUP, so that `finally` blocks run as with Ctrl-C.

    Ignored signals, such as SIGHUP under `nohup`, remain ignored.
    """

    def leave(number: int) -> bool:
        if _HeldStops.present is not None and _HeldStops.present.take(number):
            return True
        raise SystemExit(128 + number)

    with _handled(_not_ignored(_UNWINDING), leave):
        yield


def _not_ignored(numbers: Sequence[signal.Signals]) -> list[signal.Signals]:
    return [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]


class _HeldStops:
    """State of the outermost `stops_held`."""

    present: "ClassVar[_HeldStops | None]" = None

    def __init__(self) -> None:
        self.holds = True
        self.caught: list[int] = []
        self.passed = False
        """True once a signal was let through: the program stops, and further ones say nothing new."""

    def take(self, number: int) -> bool:
        """Hold a signal, or let this one through and hold those that follow; return whether it is held."""
        if self.holds:
            self.caught.append(number)
            return True
        self.holds = self.passed = True
        return False

    def deliver(self) -> None:
        """Deliver the held signals, unless one was let through."""
        caught, self.caught = self.caught, []
        if not self.passed:
            _deliver(caught)


@contextmanager
def stops_held() -> Iterator[None]:
    """Hold signals that stop a program until the end of the block, except within `stops_let_through`.

    For work that keeps its results whenever it is stopped: the first signal interrupts what waits or moves, and what
    follows runs to its end. A second one is dropped. Blocks may be nested; outside the main thread there is no effect.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
    elif (held := _HeldStops.present) is not None:
        before, held.holds = held.holds, True
        try:
            yield
        finally:
            held.holds = before
            if not before:
                held.deliver()
    else:
        held = _HeldStops.present = _HeldStops()
        try:
            with _handled(_not_ignored(STOPPING), held.take):
                yield
        finally:
            _HeldStops.present = None
            held.deliver()


@contextmanager
def stops_let_through() -> Iterator[None]:
    """Let one signal interrupt this part of a `stops_held` block, at once if it is held already."""
    if (held := _HeldStops.present) is None or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = held.holds
    try:
        held.holds = held.passed
        held.deliver()
        yield
    finally:
        held.holds = before


@contextmanager
def let_through_at_entry(manager: AbstractContextManager[Entered]) -> Iterator[Entered]:
    """Enter and exit a context manager within `stops_held`; signals interrupt the entry only."""
    with ExitStack() as stack:
        with stops_let_through():
            entered = stack.enter_context(manager)
        yield entered


def _into(caught: list[int]) -> Callable[[int], bool]:
    def take(number: int) -> bool:
        caught.append(number)
        return True

    return take


def _deliver(numbers: Sequence[int]) -> None:
    """Deliver each signal once."""
    if numbers:
        try:
            signal.raise_signal(numbers[0])
        finally:
            _deliver([number for number in numbers if number != numbers[0]])


@contextmanager
def _handled(numbers: Iterable[signal.Signals], take: Callable[[int], bool]) -> Iterator[None]:
    """Replace the handlers of signals by `take(number)` during the block; what it returns False for goes to them.

    A handler installed by the block itself is kept. Signals with a handler installed outside Python are skipped,
    because it cannot be restored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: found for number in numbers if (found := signal.getsignal(number)) is not None}
    over = False

    def handle(number: int, frame: FrameType | None) -> None:
        previous = before[signal.Signals(number)]
        # after the block, a signal has interrupted the restoring of handlers, so this one is still installed
        if not over and take(number):
            return
        if callable(previous):
            previous(number, frame)
        elif previous is signal.SIG_DFL:
            signal.signal(number, previous)
            signal.raise_signal(number)

    try:
        for number in before:
            signal.signal(number, handle)
        yield
    finally:
        over = True
        for number, previous in before.items():
            if signal.getsignal(number) is handle:
                signal.signal(number, previous)
