"""`aero-hil emulate` as a child process, for the target `pty`."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from aero.child_process import ChildError, ChildProcess
from hil.faults.schedule import FaultNeverFiredError
from hil.targets.delays import LATE, DelayLog, Loop
from hil.targets.hand_spec import HandSpec

_LOG = logging.getLogger(__name__)
START_S = 120.0
"""Time the child has to start, s; it loads a physics engine and perhaps homes, which takes 1 s on an idle machine."""
STOP_S = 10.0
"""Time the child has to leave after SIGTERM, s."""
NEVER_FIRED = "never-fired"
"""First word of the line in which the child names a fault that had no effect."""


class _Heard:
    """What the child says besides `ready`."""

    def __init__(self, delays: DelayLog) -> None:
        self.unfired: list[str] = []
        self._delays = delays

    def take(self, line: str) -> None:
        """Take one line."""
        word, _, rest = line.partition(" ")
        if word == LATE:
            self._delays.add(float(rest), Loop.BOARD)
        elif word == NEVER_FIRED:
            self.unfired.append(rest)


@contextmanager
def serve_in_process(spec: HandSpec, delays: DelayLog | None = None) -> Iterator[str]:
    """Start an emulated hand on a pseudo-terminal and yield the path a client may open; its delays go to `delays`.

    Raises:
        FaultNeverFiredError: a fault had no effect until it was stopped.
        ChildError: it did not start, or did not stop cleanly; the message carries what it printed.
    """
    command = [sys.executable, "-P", "-m", "hil.cli", "emulate", *spec.argv(), "--parent", str(os.getpid())]
    heard = _Heard(delays or DelayLog())
    child = ChildProcess(command, "`aero-hil emulate`", on_line=heard.take)
    path = child.wait_ready(START_S)
    try:
        yield path
    except BaseException:
        try:
            child.end(STOP_S)
        except ChildError as error:  # what came first is what went wrong
            _LOG.warning("%s", error)
        raise
    status = child.end(STOP_S)
    if heard.unfired:
        raise FaultNeverFiredError(heard.unfired)
    if status:
        raise ChildError(f"`aero-hil emulate` ended with status {status}: {child.errors}")
