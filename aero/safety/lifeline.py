"""A second process that opens the hand when the first one is killed.

Ctrl-C, errors and polite termination run the guard's own ending. A program that is killed outright, or whose
interpreter crashes, cannot; its pipe to this process closes all the same, and the port's lock is free again.

The process runs `aero.safety.__main__`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from aero.safety.thresholds import Thresholds

ALL_WELL = b"."
"""What the guarded program sends when it has opened the hand itself."""
LEAVE_S = 5.0
"""Time the process has to leave after that, s."""


@contextmanager
def lifeline(port: str, thresholds: Thresholds, *, settable: bool) -> Iterator[Callable[[], None]]:
    """Yield a function that starts the process; call it before the first motion.

    Args:
        port: device path or URL of the hand.
        thresholds: how slowly and how weakly it is opened.
        settable: whether the firmware takes speed and torque limits.
    """
    processes: list[subprocess.Popen[bytes]] = []
    settings = json.dumps({"settable": settable, "thresholds": thresholds.as_dict()})

    def start() -> None:
        command = [sys.executable, "-m", "aero.safety", port, settings]
        # In a session of its own, so that Ctrl-C and a closed terminal do not reach it.
        processes.append(subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True))

    try:
        yield start
    finally:
        for process in processes:
            process.communicate(ALL_WELL, timeout=LEAVE_S)
