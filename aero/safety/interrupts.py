"""Signals around a hand that must not be left closed."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from types import FrameType

_STOPPING = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)  # SIGHUP, a closed terminal, is unknown to Windows
_UNWINDING = tuple(number for number in _STOPPING if number != signal.SIGINT)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold signals that stop a program back until the block is over; outside the main thread there are none."""
    with noted(*_STOPPING) as caught:
        yield
    for number in dict.fromkeys(caught):
        signal.raise_signal(number)


@contextmanager
def noted(*numbers: signal.Signals) -> Iterator[list[int]]:
    """Yield a list that takes up these signals instead of what they did, for a loop that looks at it.

    Afterwards they do again what they did before; outside the main thread the list stays empty.
    """
    caught: list[int] = []
    with _handled(numbers, lambda number, _frame: caught.append(number)):
        yield caught


@contextmanager
def unwinding() -> Iterator[None]:
    """Let a terminated program, or one whose terminal was closed, run its `finally` blocks, as Ctrl-C does.

    A signal that the program was told to ignore, as `nohup` does with a closed terminal's, stays ignored.
    """

    def leave(number: int, _frame: FrameType | None) -> None:
        raise SystemExit(128 + number)

    with _handled([number for number in _UNWINDING if signal.getsignal(number) is not signal.SIG_IGN], leave):
        yield


@contextmanager
def _handled(numbers: Iterable[signal.Signals], handler: signal._HANDLER) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, previous in before.items():
            signal.signal(number, previous)
