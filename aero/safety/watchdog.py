"""Watchdog thread that polls a hand on a port if its program does not, as in a long callback."""

import logging
import threading
from collections.abc import Callable

from aero.clock import Clock, finite_s
from aero.safety.stop import SafetyStopError

_LOG = logging.getLogger(__name__)


class Watchdog:
    """Thread that periodically checks for a hand without polls.

    The guard's lock keeps its polls between two calls of the program. The thread needs the interpreter: a C library
    that holds the interpreter lock, or a stopped process, stops the watchdog too.
    """

    def __init__(self, check: Callable[[], None], period_s: float) -> None:
        """Store the check; `start` starts the thread.

        Args:
            check: polls the hand if its program has not for too long.
            period_s: period of the checks, s.
        """
        self._check = check
        self._period_s = period_s
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Start the thread; no effect if it already runs."""
        # `is_alive`, because an interrupted start may have created a thread that never ran.
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._run, name="aero watchdog", daemon=True)
            self._thread.start()

    def end(self) -> None:
        """Stop the checks, without waiting for one in progress."""
        self._ended.set()

    def _run(self) -> None:
        while not self._ended.wait(self._period_s):
            try:
                self._check()
            except (SafetyStopError, ConnectionError) as error:
                _LOG.info("the watchdog ends: %s", error)  # the program's next call raises it too
                return


class WatchedClock:
    """Clock that splits waits into pieces and polls the hand after each."""

    def __init__(self, clock: Clock, look: Callable[[], None], piece_s: float) -> None:
        self._clock = clock
        self._look = look
        self._piece_s = piece_s

    @property
    def bare(self) -> Clock:
        """Wrapped clock, without polls."""
        return self._clock

    def now(self) -> float:
        """Return the time in s."""
        return self._clock.now()

    def sleep_until(self, t: float) -> None:
        """Wait until `now()` is at least `t` (s).

        Raises:
            ValueError: `t` is not finite.
            SafetyStopError: raised by a poll.
        """
        finite_s(t)
        while (now := self._clock.now()) < t:
            self._clock.sleep_until(min(t, now + self._piece_s))
            self._look()
