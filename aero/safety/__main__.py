"""Standby process of a guarded program: wait for its end, and open the hand unless the program has.

Started by `aero.safety.standby` as `python -m aero.safety PORT SETTINGS`, settings as JSON; not for users.
"""

import json
import os
import signal
import sys
from collections.abc import Callable

from aero.child_process import READY
from aero.clock import Clock, Deadline, WallClock
from aero.driver import AeroHand
from aero.safety.known_port import KnownPort
from aero.safety.opening import SWITCH_OFF, open_and_relax
from aero.safety.regions import Region
from aero.safety.standby import ALL_WELL
from aero.safety.thresholds import Thresholds

LONGEST_S = 25.0
"""Time limit for a port that disappears and reappears repeatedly, s; without it a failing port is retried for ever."""
HOMES_S = 60.0
"""Time-out for opening a hand with a silent board, s: after its start a board homes for up to 45 s."""
RETRY_S = 0.1


def main(port: str, settings: str) -> None:
    """Wait for the end of standard input, and open the hand at `port` unless the input was `ALL_WELL`."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    asked = json.loads(settings)
    known = KnownPort.of(port)
    try:
        os.write(sys.stdout.fileno(), f"{READY}\n".encode())
    except BrokenPipeError:
        return  # the program was killed before it moved the hand
    if sys.stdin.buffer.read() == ALL_WELL.encode():
        return
    doubt = open_what_was_left(
        lambda: AeroHand.open_unguarded(known.now()),
        WallClock(),
        Thresholds(**asked["thresholds"], forbidden=tuple(map(Region.of, asked["forbidden"]))),
        settable=asked["settable"],
    )
    if doubt is not None:
        sys.exit(f"{port}: no program guards the hand now, and it may not be open. {SWITCH_OFF}, because {doubt}")


def open_what_was_left(
    connect: Callable[[], AeroHand], clock: Clock, thresholds: Thresholds, *, settable: bool
) -> str | None:
    """Open the hand of a program that has ended; return the reason why it may not be open, or None.

    The port may still be locked, or disappear briefly when the board loses power; each time it is retried for
    `Thresholds.opening_patience_s`. A silent board may be homing and is retried for `HOMES_S`.

    Args:
        connect: opens the port; raises `ConnectionError` on failure.
        clock: clock of the hand.
        thresholds: speed, torque and time-outs of the opening.
        settable: whether the firmware has speed and torque limits.
    """
    whole, homing = Deadline.after(clock, LONGEST_S), Deadline.after(clock, HOMES_S)
    back = Deadline.after(clock, thresholds.opening_patience_s)
    while True:
        connected = False
        try:
            with connect() as hand:
                connected = True
                doubt = open_and_relax(hand, clock, thresholds, settable=settable)
                while doubt is not None and hand.silent_from is not None and not homing.expired:
                    doubt = open_and_relax(hand, clock, thresholds, settable=settable)
                return doubt
        except ConnectionError as error:
            if connected:
                back = Deadline.after(clock, thresholds.opening_patience_s)
            if back.expired or whole.expired:
                return str(error)
        clock.sleep_until(clock.now() + RETRY_S)


if __name__ == "__main__":
    main(*sys.argv[1:])
