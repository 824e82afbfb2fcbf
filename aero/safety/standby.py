"""Standby process that opens the hand if the guarded program is killed.

After Ctrl-C, an error or SIGTERM the guard opens the hand itself. A killed or crashed program cannot, but the system
closes its pipe to the standby process and releases the port. Forked processes close their copies of both at once.

The standby process runs `aero.safety.__main__`.
"""

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
"""Message of the guarded program after it has opened the hand and verified that."""
START_S = 30.0
"""Time-out for the start of the process, s; Python and NumPy take 0.3 s on an idle machine."""
LEAVE_S = 30.0
"""Time-out for the end of the process, s, in which it may have to open the hand."""
_OUTLIVING = frozenset({"systemd", "init", "launchd"})
"""Names of init programs, which run as process 1 until shutdown."""
_RUN = "from aero.safety.__main__ import main; main(*{arguments!r})"


def ends_with_process_1() -> str | None:
    """Return a warning if the standby process may end with this program, as in most containers, or None."""
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
    """Standby process of one guarded hand."""

    def __init__(self, port: str, thresholds: Thresholds, *, settable: bool) -> None:
        """Store the arguments of the process; `start` starts it.

        Args:
            port: device path or URL of the hand.
            thresholds: speed and torque of the opening.
            settable: whether the firmware has speed and torque limits.
        """
        self._arguments = (
            port,
            json.dumps(
                {
                    "settable": settable,
                    "thresholds": thresholds.as_dict(),
                    "forbidden": [region.as_table() for region in thresholds.forbidden],
                }
            ),
        )
        self._process: ChildProcess | None = None
        self._ready = False

    def start(self) -> None:
        """Start the process and wait until it is ready; no effect if it already runs.

        An interrupted wait, as by Ctrl-C, ends the process.

        Raises:
            SafetyStopError: the process did not become ready.
        """
        if self._ready and self._process is not None and self._process.running:
            return
        self._end()
        if (in_container := ends_with_process_1()) is not None:
            _LOG.warning(in_container)
        command = python(_RUN.format(arguments=self._arguments))
        try:
            with uninterrupted():  # without a reference the process could not be ended
                self._process = ChildProcess(command, "the second process", own_errors=False)
            self._process.wait_ready(START_S)
            self._ready = True
        except ChildError:
            raise SafetyStopError(
                f"not moved. The second process, which opens the hand should this one be killed, did not start within "
                f"{START_S:g} s; its output is above.",
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
        """End the process without action, for an open hand."""
        self._leave(ALL_WELL)

    def take_over(self) -> None:
        """Make the process open the hand; the port must be released."""
        _LOG.warning("the second process is left to open the hand")
        self._leave("")

    def _leave(self, message: str) -> None:
        if (process := self._taken()) is not None:
            process.dismiss(message)
            if process.wait(LEAVE_S):  # otherwise the process continues on its own
                process.kill()  # closes the remaining pipes

    def _taken(self) -> ChildProcess | None:
        """Return the process and clear the reference to it."""
        process, self._process, self._ready = self._process, None, False
        return process
