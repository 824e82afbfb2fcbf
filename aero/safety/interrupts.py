"""Signals around a hand that must not be left closed."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

_STOPPING = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)  # SIGHUP, a closed terminal, is unknown to Windows
_UNWINDING = tuple(number for number in _STOPPING if number != signal.SIGINT)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold signals that stop a program back until the block is over, however it ends; none outside the main thread.

    Each signal is delivered once. Where several raise, the last exception is raised in the context of the others.
    """
    caught: list[int] = []
    try:
        with _handled(_STOPPING, caught.append):
            yield
    finally:
        _deliver(list(dict.fromkeys(caught)))


@contextmanager
def noted(*numbers: signal.Signals) -> Iterator[list[int]]:
    """Yield a list that takes up these signals instead of what they did, for a loop that reads it.

    Afterwards they do again what they did before; outside the main thread the list stays empty.
    """
    caught: list[int] = []
    with _handled(numbers, caught.append):
        yield caught


@contextmanager
def unwinding() -> Iterator[None]:
    """Let a terminated program, or one whose terminal was closed, run its `finally` blocks, as Ctrl-C does.

    A signal that the program ignores, as `nohup` does with a closed terminal's, stays ignored.
    """

    def leave(number: int) -> None:
        raise SystemExit(128 + number)

    with _handled([number for number in _UNWINDING if signal.getsignal(number) is not signal.SIG_IGN], leave):
        yield


def _deliver(numbers: Sequence[int]) -> None:
    if numbers:
        try:
            signal.raise_signal(numbers[0])
        finally:
            _deliver(numbers[1:])


@contextmanager
def _handled(numbers: Iterable[signal.Signals], act: Callable[[int], None]) -> Iterator[None]:
    """Call `act` with the number of a signal, in place of its handler, while the block runs.

    A handler that the block itself installs stays. One that was not installed from Python cannot be put back, so its
    signal is left alone.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: found for number in numbers if (found := signal.getsignal(number)) is not None}
    over = False

    def handle(number: int, frame: FrameType | None) -> None:
        previous = before[signal.Signals(number)]
        if not over:
            act(number)
        elif callable(previous):
            # A signal has interrupted the putting back of handlers, so this one is still installed.
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
