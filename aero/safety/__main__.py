"""What `aero.safety.standby` starts: wait for a guarded program to end, and open the hand unless it has.

`python -m aero.safety PORT SETTINGS`, with the settings as JSON; not for the command line.
"""

from __future__ import annotations

import json
import os
import signal
import sys

from aero.child_process import READY
from aero.clock import Deadline, WallClock
from aero.driver import AeroHand
from aero.safety.opening import SWITCH_OFF, Doubt, open_and_relax
from aero.safety.standby import ALL_WELL
from aero.safety.thresholds import Thresholds

PORT_FREE_S = 3.0
"""How long a port may stay locked after its program has died, s."""
RETRY_S = 0.1


def main(port: str, settings: str) -> None:
    """Wait until standard input ends, and open the hand at `port` unless it ended with `ALL_WELL`."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    asked = json.loads(settings)
    thresholds = Thresholds(**asked["thresholds"])
    try:
        os.write(sys.stdout.fileno(), f"{READY}\n".encode())
    except BrokenPipeError:
        return  # the program was killed while it waited for this, before it moved anything
    if sys.stdin.buffer.read() == ALL_WELL.encode():
        return
    try:
        with _opened(port) as hand:
            doubt = open_and_relax(hand, WallClock(), thresholds, settable=asked["settable"])
    except ConnectionError as error:
        doubt = Doubt(str(error))
    if doubt:
        sys.exit(
            f"{port}: the program that moved the hand has ended without opening it. {SWITCH_OFF}, because {doubt.text}"
        )


def _opened(port: str) -> AeroHand:
    clock = WallClock()
    deadline = Deadline.after(clock, PORT_FREE_S)
    while True:
        try:
            return AeroHand.open_unguarded(port)
        except ConnectionError:
            if deadline.expired:
                raise
            clock.sleep_until(clock.now() + RETRY_S)


if __name__ == "__main__":
    main(*sys.argv[1:])
