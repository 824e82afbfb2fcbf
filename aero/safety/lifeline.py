"""A second process that opens the hand when the first one is killed.

Ctrl-C, errors and polite termination run the guard's own ending. A program that is killed outright, or whose
interpreter crashes, cannot; its pipe to this process closes all the same, and the port's lock is free again.

Run as `python -m aero.safety.lifeline PORT SETTINGS`; not for the command line.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from aero.clock import Deadline, WallClock
from aero.driver import AeroHand
from aero.safety.opening import open_and_relax
from aero.safety.thresholds import Thresholds

ALL_WELL = b"."
"""What the guarded program sends when it has opened the hand itself."""
LEAVE_S = 5.0
"""Time the process has to leave after that, s."""
PORT_FREE_S = 3.0
"""How long a port may stay locked after its program has died, s."""
RETRY_S = 0.1


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
        command = [sys.executable, "-m", __name__, port, settings]
        # In a session of its own, so that Ctrl-C and a closed terminal do not reach it.
        processes.append(subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True))

    try:
        yield start
    finally:
        for process in processes:
            process.communicate(ALL_WELL, timeout=LEAVE_S)


def main(port: str, settings: str) -> None:
    """Wait for the guarded program to end, and open the hand unless it has."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    if sys.stdin.buffer.read() == ALL_WELL:
        return
    asked = json.loads(settings)
    with _opened(port) as hand:
        open_and_relax(hand, WallClock(), Thresholds(**asked["thresholds"]), settable=asked["settable"])


def _opened(port: str) -> AeroHand:
    clock = WallClock()
    deadline = Deadline.after(clock, PORT_FREE_S)
    while True:
        try:
            return AeroHand.open(port)
        except ConnectionError:
            if deadline.expired:
                raise
            clock.sleep_until(clock.now() + RETRY_S)


if __name__ == "__main__":
    main(*sys.argv[1:])
