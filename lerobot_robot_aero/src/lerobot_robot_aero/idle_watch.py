"""Background polling of a guarded hand while the program is busy.

A guard polls its hand during the program's calls, and opens a hand that was not polled for ten seconds. LeRobot makes
no calls while saving an episode or encoding videos, with the fingers still closed.
"""

import logging
import threading
from types import TracebackType
from typing import Self

from aero.errors import AeroError
from aero.hand import Hand
from aero.safety import SafetyStopError

_LOG = logging.getLogger(__name__)
IDLE_S = 0.1
"""Period of the polls, and age of the last reading above which the thread polls, s."""


class IdleWatch:
    """Thread that polls a hand between the program's calls.

    The lock guards every exchange with the hand: the program takes the lock for each call, the thread for each poll.
    """

    def __init__(self, hand: Hand, lock: threading.Lock) -> None:
        """Prepare the thread; the `with` statement starts polling."""
        self._hand = hand
        self._lock = lock
        self._ended = threading.Event()

    def __enter__(self) -> Self:
        # A daemon thread, so that a program can exit without disconnecting; the standby process then opens the hand.
        self._thread = threading.Thread(target=self._run, name="idle watch", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(IDLE_S):
            with self._lock:
                if self._hand.reading_age_s >= IDLE_S and not self._look():
                    return

    def _look(self) -> bool:
        """Poll the hand; return whether to continue. A fatal error recurs in the program's next call."""
        try:
            self._hand.read_codes()
        except AeroError as error:
            _LOG.info("%s: a poll was not answered: %s", self._hand.name, error)
        except (SafetyStopError, ConnectionError) as error:
            _LOG.info("no longer watched: %s", error)
            return False
        return True
