"""What `aero.safety.standby` starts: wait for a guarded program to end, and open the hand unless it has.

`python -m aero.safety PORT SETTINGS`, with the settings as JSON; not for the command line.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable

from aero.child_process import READY
from aero.clock import Clock, Deadline, WallClock
from aero.driver import AeroHand
from aero.safety.opening import SWITCH_OFF, Doubt, open_and_relax
from aero.safety.standby import ALL_WELL
from aero.safety.thresholds import Thresholds
from aero.usb_port import UsbPort

LONGEST_S = 25.0
"""Time in which the port may go and come back again and again, s: it may, like one whose writes fail, never be well."""
RETRY_S = 0.1


def main(port: str, settings: str) -> None:
    """Wait until standard input ends, and open the hand at `port` unless it ended with `ALL_WELL`."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    asked = json.loads(settings)
    usb = UsbPort.of(port)
    try:
        os.write(sys.stdout.fileno(), f"{READY}\n".encode())
    except BrokenPipeError:
        return  # the program was killed while it waited for this, before it moved anything
    if sys.stdin.buffer.read() == ALL_WELL.encode():
        return
    doubt = open_what_was_left(
        lambda: AeroHand.open_unguarded(usb.now()),
        WallClock(),
        Thresholds(**asked["thresholds"]),
        settable=asked["settable"],
    )
    if doubt:
        sys.exit(
            f"{port}: the program that moved the hand has ended without opening it. {SWITCH_OFF}, because {doubt.text}"
        )


def open_what_was_left(
    connect: Callable[[], AeroHand], clock: Clock, thresholds: Thresholds, *, settable: bool
) -> Doubt | None:
    """Open the hand of a program that has ended; return why it may not be open, or None.

    Its port may still be locked, and may go and come back meanwhile, as when the board loses power for a moment: it is
    waited for as long as for a hand that does not open, `Thresholds.opening_patience_s`, each time.

    Args:
        connect: opens the port; it raises `ConnectionError` while that cannot be.
        clock: of the hand.
        thresholds: how slowly, how weakly and how patiently.
        settable: whether the firmware takes speed and torque limits.
    """
    whole = Deadline.after(clock, LONGEST_S)
    back = Deadline.after(clock, thresholds.opening_patience_s)
    while True:
        connected = False
        try:
            with connect() as hand:
                connected = True
                return open_and_relax(hand, clock, thresholds, settable=settable)
        except ConnectionError as error:
            if connected:
                back = Deadline.after(clock, thresholds.opening_patience_s)
            if back.expired or whole.expired:
                return Doubt(str(error))
        clock.sleep_until(clock.now() + RETRY_S)


if __name__ == "__main__":
    main(*sys.argv[1:])
