"""A second process that opens the hand when the first one is killed.

Ctrl-C, errors and polite termination run the guard's own ending. A program that is killed outright, or whose
interpreter crashes, cannot; its pipe to this process closes all the same, and the port's lock is free again. A process
that the program forks lets go of both at once.

The process runs `aero.safety.__main__`.
"""

from __future__ import annotations

import json
import logging
import os
from contextlib import suppress
from pathlib import Path

from aero.child_process import ChildError, ChildProcess, python
from aero.safety.interrupts import uninterrupted
from aero.safety.stop import SafetyReason, SafetyStopError
from aero.safety.thresholds import Thresholds

_LOG = logging.getLogger(__name__)
ALL_WELL = "."
"""What the guarded program sends when it has opened the hand itself, and seen that it is open."""
START_S = 30.0
"""Time the process has to start, s; Python and NumPy take 0.3 s on an idle machine."""
LEAVE_S = 30.0
"""Time the process has to leave, s, in which it may have to open the hand."""
_OUTLIVING = frozenset({"systemd", "init", "launchd"})
"""Programs that are process 1 for as long as the machine runs."""
_RUN = "from aero.safety.__main__ import main; main(*{arguments!r})"


def ends_with_process_1() -> str | None:
    """Return a warning where the second process may end with this program, as in most containers; else None."""
    if os.name != "posix" or 1 not in {os.getpid(), os.getppid()}:
        return None
    with suppress(OSError):
        if Path("/proc/1/comm").read_text(encoding="utf-8").strip() in _OUTLIVING:
            return None
    place = "process 1" if os.getpid() == 1 else "a child of process 1"
    return (
        f"this program is {place} of its container. When process 1 ends, the system ends the second process too: if "
        "this program is killed then, its hand stays closed. Let process 1 live for 90 s longer, as in sh -c "
        "'PROGRAM; sleep 90', or start the program by docker exec; --init does not help."
    )


class Standby:
    """The second process of one guarded hand."""

    def __init__(self, port: str, thresholds: Thresholds, *, settable: bool) -> None:
        """Prepare it; nothing runs before `start`.

        Args:
            port: device path or URL of the hand.
            thresholds: how slowly and how weakly it is opened.
            settable: whether the firmware takes speed and torque limits.
        """
        self._arguments = (port, json.dumps({"settable": settable, "thresholds": thresholds.as_dict()}))
        self._process: ChildProcess | None = None
        self._ready = False

    def start(self) -> None:
        """Start it and wait until it is ready; nothing happens when it runs already.

        What interrupts the wait, as Ctrl-C, ends it.

        Raises:
            SafetyStopError: it is not ready; the message carries what it printed.
        """
        if self._ready and self._process is not None and self._process.running:
            return
        self._end()
        if (in_container := ends_with_process_1()) is not None:
            _LOG.warning(in_container)
        command = python(_RUN.format(arguments=self._arguments))
        try:
            with uninterrupted():  # a process that nothing refers to could not be ended
                self._process = ChildProcess(command, "the second process", own_errors=False)
            self._process.wait_ready(START_S)
            self._ready = True
        except ChildError:
            raise SafetyStopError(
                f"not moved. The second process, which opens the hand should this one be killed, did not start within "
                f"{START_S:g} s; what it printed is above.",
                SafetyReason.NO_STANDBY,
            ) from None
        finally:
            if not self._ready:
                self._end()
        _LOG.info("process %d opens the hand should this one be killed", self._process.pid)

    def _end(self) -> None:
        """End a process that has not become ready, or has died."""
        if (process := self._taken()) is not None:
            process.kill()

    def stand_down(self) -> None:
        """Let it go: the hand is open."""
        self._leave(ALL_WELL)

    def take_over(self) -> None:
        """Let it try to open the hand, whose port is free now."""
        _LOG.warning("the second process is left to open the hand")
        self._leave("")

    def _leave(self, message: str) -> None:
        if (process := self._taken()) is not None:
            process.dismiss(message)
            if process.wait(LEAVE_S):  # else it continues without us
                process.kill()  # closes what is left of its pipes

    def _taken(self) -> ChildProcess | None:
        """Return the process, which is not this one's any more."""
        process, self._process, self._ready = self._process, None, False
        return process
