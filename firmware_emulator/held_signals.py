"""Signals of the main thread, held until an event of the kernel is complete.

A signal handler that raises, as that of Ctrl-C or of a test's time-out, would end the generator of a task at any line,
and its board would never answer again. The handlers are replaced for the length of one `Kernel.run_until`. A signal
that arrives meanwhile ends the run after the present event, and is delivered then.

Handlers are replaced instead of blocking the signals, because with a second thread the system delivers a signal there
and Python calls its handler in the main thread nevertheless.
"""

import _signal  # type: ignore[import-not-found]  # the enums of `signal` cost more than an event of the kernel
import inspect
import signal
import sys
from collections.abc import Callable, Sequence
from threading import get_ident, main_thread
from types import FrameType

MOST = 3
"""Number of signals from which one is delivered at once: the event hangs."""
_NAMES = ("SIGINT", "SIGALRM", "SIGTERM", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGBREAK")
"""Signals whose handlers programs let raise."""
_NUMBERS = tuple(int(getattr(signal, name)) for name in _NAMES if hasattr(signal, name))


class HeldSignals:
    """One hold, from `hold` to `release`; without effect outside the main thread and within another hold."""

    _present: "HeldSignals | None" = None

    def __init__(self, on_signal: Callable[[], object] = lambda: None) -> None:
        """Create a hold; `on_signal` is called at each held signal, in the middle of the block."""
        self._on_signal = on_signal
        self._before: dict[int, Callable[[int, FrameType | None], object]] = {}
        self._caught: list[int] = []
        self._frame: FrameType | None = None
        """Frame of the block; None before and after it."""

    def hold(self) -> None:
        """Begin to hold; `release` must follow even if this raises."""
        if get_ident() != main_thread().ident:
            return
        frame, other = sys._getframe(1), HeldSignals._present
        if other is not None and other._is_left(frame):
            other._end()
        elif other is not None:
            return
        self._frame, HeldSignals._present = frame, self
        note = self._note
        for number in _NUMBERS:
            if callable(previous := _signal.getsignal(number)):
                self._before[number] = previous
                _signal.signal(number, note)

    def release(self) -> bool:
        """Restore the handlers and deliver each held signal once; return whether there was one."""
        if HeldSignals._present is not self:
            return False
        try:
            self._end()
        finally:
            if self._caught:
                self._deliver(list(dict.fromkeys(self._caught)))
        return bool(self._caught)

    def _is_left(self, frame: FrameType | None) -> bool:
        """Return whether the block is not among the callers of a frame: it is over, or an exception has ended it."""
        while frame is not None and frame is not self._frame:
            frame = frame.f_back
        return frame is None

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._caught.append(number)
        if left := self._is_left(frame):
            self._end()  # this signal may have interrupted it, and may raise
        if left or len(self._caught) >= MOST:
            self._caught.remove(number)
            self._before[number](number, frame)
        else:
            self._on_signal()

    def _end(self) -> None:
        """Restore the handlers."""
        self._frame, note = None, self._note
        for number, previous in self._before.items():
            if _signal.getsignal(number) == note:  # else replaced within the event
                _signal.signal(number, previous)
        if HeldSignals._present is self:
            HeldSignals._present = None

    def _deliver(self, numbers: Sequence[int]) -> None:
        if numbers:
            try:
                self._before[numbers[0]](numbers[0], inspect.currentframe())
            finally:
                self._deliver(numbers[1:])
