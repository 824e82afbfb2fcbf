"""Watching a guarded hand while its program does something else.

A guard polls its hand in the calls of the program, and opens a hand that nobody has polled for ten seconds.
LeRobot makes no calls while it saves an episode or encodes its films, with the fingers still closed.
"""

from __future__ import annotations

import logging
import threading
from types import TracebackType
from typing import Self

from aero.errors import AeroError
from aero.hand import Hand
from aero.safety import SafetyStopError

_LOG = logging.getLogger(__name__)
IDLE_S = 0.1
"""How long the program may leave the hand alone before it is looked at here, s."""


class IdleWatch:
    """Polls a hand now and then, from a thread of its own.

    The lock covers every exchange with the hand: the program holds it for each of its calls, the thread for each poll.
    """

    def __init__(self, hand: Hand, lock: threading.Lock) -> None:
        """Prepare to watch; nothing is read before the `with` statement."""
        self._hand = hand
        self._lock = lock
        self._ended = threading.Event()

    def __enter__(self) -> Self:
        # A daemon, so that a program that never disconnects can still end; the standby process opens its hand.
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
        """Poll the hand, and return whether to continue; what ends it is raised again in the program's next call."""
        try:
            self._hand.read_codes()
        except AeroError as error:
            _LOG.info("%s: a poll was not answered: %s", self._hand.name, error)
        except (SafetyStopError, ConnectionError) as error:
            _LOG.info("no longer watched: %s", error)
            return False
        return True
