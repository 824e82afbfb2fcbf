"""Polls a hand on a port when its program does not, as in a callback that takes half a minute."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from aero.clock import Clock, finite_s
from aero.safety.stop import SafetyStopError

_LOG = logging.getLogger(__name__)


class Watchdog:
    """A thread that asks now and then whether its hand goes unwatched.

    It shares the guard's lock, so that it comes between two calls of the program and never into one. It needs Python
    to run: a call of a C library that keeps the interpreter lock, or a stopped process, stops it too.
    """

    def __init__(self, check: Callable[[], None], period_s: float) -> None:
        """Prepare it; nothing runs before `start`.

        Args:
            check: polls the hand if its program has not for too long.
            period_s: time from one check to the next, s.
        """
        self._check = check
        self._period_s = period_s
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Start it; nothing happens when it runs already."""
        # Asked whether it runs: what interrupted an earlier start may have left a thread that was made and never ran.
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._run, name="aero watchdog", daemon=True)
            self._thread.start()

    def end(self) -> None:
        """Check no more; does not wait for a check that is being made."""
        self._ended.set()

    def _run(self) -> None:
        while not self._ended.wait(self._period_s):
            try:
                self._check()
            except (SafetyStopError, ConnectionError) as error:
                _LOG.info("the watchdog ends: %s", error)  # the program's next call raises it too
                return


class WatchedClock:
    """A clock whose waits are cut into pieces, with a poll of the hand after each."""

    def __init__(self, clock: Clock, look: Callable[[], None], piece_s: float) -> None:
        self._clock = clock
        self._look = look
        self._piece_s = piece_s

    @property
    def bare(self) -> Clock:
        """The clock behind."""
        return self._clock

    def now(self) -> float:
        """Return the time in s."""
        return self._clock.now()

    def sleep_until(self, t: float) -> None:
        """Return when `now()` is at least `t` (s).

        Raises:
            ValueError: `t` is not finite.
            SafetyStopError: what `look` raises.
        """
        finite_s(t)
        while (now := self._clock.now()) < t:
            self._clock.sleep_until(min(t, now + self._piece_s))
            self._look()
