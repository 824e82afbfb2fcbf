"""Deferring and handling of signals, so that a hand is never left closed."""

import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

from aero.exit_code import STOPPING

_UNWINDING = tuple(number for number in STOPPING if number != signal.SIGINT)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Defer signals that stop a program to the end of the block; no effect outside the main thread.

    Each signal is delivered once. If several raise, the last exception has the others as its context.
    """
    caught: list[int] = []
    try:
        with _handled(STOPPING, caught.append):
            yield
    finally:
        _deliver(list(dict.fromkeys(caught)))


@contextmanager
def noted(*numbers: signal.Signals) -> Iterator[list[int]]:
    """Yield a list of received signals, in place of their handlers, for a loop that polls it.

    The handlers are restored afterwards; outside the main thread the list remains empty.
    """
    caught: list[int] = []
    with _handled(numbers, caught.append):
        yield caught


@contextmanager
def unwinding() -> Iterator[None]:
    """Raise SystemExit on SIGTERM and SIGHUP, so that `finally` blocks run as with Ctrl-C.

    Ignored signals, such as SIGHUP under `nohup`, remain ignored.
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
    """Replace the handlers of signals by `act(number)` during the block.

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
        if not over:
            act(number)
        elif callable(previous):
            # A signal has interrupted the restoring of handlers, so this one is still installed.
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
