"""What the program logs while a recording is made, as events of the recording."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from hil.recordings.recording import Severity

LOGGERS = ("aero", "hil")
"""Packages whose lines are taken."""


class LogLines(logging.Handler):
    """Hands lines of level INFO and above to a recording, those of the thread that makes it.

    Other threads only look at the hand, and a recording is for one thread.
    """

    def __init__(self, keep: Callable[[str, Severity], None]) -> None:
        """Prepare; nothing comes before `begin`."""
        super().__init__(logging.INFO)
        self._keep = keep
        self._thread = threading.get_ident()
        self._levels: dict[str, int] = {}
        """What the loggers let through before, for `end`."""

    def begin(self) -> None:
        """Take lines from now on."""
        for logger in map(logging.getLogger, LOGGERS):
            self._levels[logger.name] = logger.level
            logger.setLevel(min(logging.INFO, logger.getEffectiveLevel()))
            logger.addHandler(self)

    def end(self) -> None:
        """Take no more lines; a second call does nothing."""
        while self._levels:
            name, level = self._levels.popitem()
            logger = logging.getLogger(name)
            logger.removeHandler(self)
            logger.setLevel(level)

    def emit(self, record: logging.LogRecord) -> None:
        """Hand one line over."""
        if record.thread != self._thread:
            return
        if record.levelno >= logging.WARNING:
            self._keep(record.getMessage(), "error" if record.levelno >= logging.ERROR else "warning")
        else:
            self._keep(record.getMessage(), "info")
