"""What `aero.safety.standby` starts: wait for a guarded program to end, and open the hand unless it has.

`python -m aero.safety PORT SETTINGS`, with the settings as JSON; not for the command line.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from serial.tools import list_ports

from aero.child_process import READY
from aero.clock import Clock, Deadline, WallClock
from aero.driver import AeroHand
from aero.safety.opening import SWITCH_OFF, open_and_relax
from aero.safety.standby import ALL_WELL
from aero.safety.thresholds import Thresholds

LONGEST_S = 25.0
"""Time in which the port may go and come back again and again, s: it may, like one whose writes fail, never be well."""
HOMES_S = 60.0
"""Time in which a hand whose board is silent is tried again, s: a board that has started homes for up to 45 s."""
RETRY_S = 0.1


def main(port: str, settings: str) -> None:
    """Wait until standard input ends, and open the hand at `port` unless it ended with `ALL_WELL`."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    asked = json.loads(settings)
    known = KnownPort.of(port)
    try:
        os.write(sys.stdout.fileno(), f"{READY}\n".encode())
    except BrokenPipeError:
        return  # the program was killed while it waited for this, before it moved anything
    if sys.stdin.buffer.read() == ALL_WELL.encode():
        return
    doubt = open_what_was_left(
        lambda: AeroHand.open_unguarded(known.now()),
        WallClock(),
        Thresholds(**asked["thresholds"]),
        settable=asked["settable"],
    )
    if doubt is not None:
        sys.exit(f"{port}: the program has ended, and the hand may not be open. {SWITCH_OFF}, because {doubt}")


def open_what_was_left(
    connect: Callable[[], AeroHand], clock: Clock, thresholds: Thresholds, *, settable: bool
) -> str | None:
    """Open the hand of a program that has ended; return why it may not be open, or None.

    Its port may still be locked, and may go and come back meanwhile, as when the board loses power for a moment: it is
    waited for as long as for a hand that does not open, `Thresholds.opening_patience_s`, each time. A board that is
    silent may be homing, and is tried for `HOMES_S`.

    Args:
        connect: opens the port; it raises `ConnectionError` while that cannot be.
        clock: of the hand.
        thresholds: how slowly, how weakly and how patiently.
        settable: whether the firmware takes speed and torque limits.
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


@dataclass(frozen=True)
class KnownPort:
    """A port, and what tells whether the device behind it is still the same.

    A USB device is known by its serial number, and may come back under another name. A symbolic link names a device by
    itself (`/dev/serial/by-id`, `aero-hil emulate --link`). Any other port is known by its device file: where the file
    was made again, nobody can say what is behind it.
    """

    name: str
    """Device path or pyserial URL by which it was opened."""
    device: tuple[int, int, str] | None
    """Vendor, product and serial number; None for what is not a USB device, or has none."""
    file: tuple[int, ...] | None
    """Identity of the device file; None where the name is a link, or not that of a file."""

    @classmethod
    def of(cls, name: str) -> Self:
        """Take down which device is behind a port."""
        path = os.path.realpath(name)
        return cls(name, next((device for port, device in _devices() if port == path), None), _file(name))

    def now(self) -> str:
        """Return the name that the port has now.

        Raises:
            ConnectionError: the device is gone. What has its old name by now may be another one.
        """
        if self.device is None:
            if self.file is not None and _file(self.name) != self.file:
                raise ConnectionError(
                    f"{self.name}: the port was gone. It has no serial number, so what has its name now may be another "
                    "device, and is left alone"
                )
            return self.name
        for port, device in _devices():
            if device == self.device:
                return self.name if port == os.path.realpath(self.name) else port
        raise ConnectionError(f"{self.name}: the USB device with the serial number {self.device[2]} is gone")


def _file(name: str) -> tuple[int, ...] | None:
    """Return what changes when a device file is made again; None for a link, and where there is no such file.

    The number of a pseudo-terminal's file is that of the terminal before it; the time of its making is not.
    """
    try:
        if Path(name).is_symlink():
            return None
        found = Path(name).stat()
    except OSError:
        return None
    made_ns = (found.st_ctime_ns,) if name.startswith("/dev/pts/") else ()
    return (found.st_dev, found.st_ino, *made_ns)


def _devices() -> list[tuple[str, tuple[int, int, str]]]:
    """Return the path of every port whose device has a serial number, with vendor, product and number."""
    return [
        (os.path.realpath(info.device), (info.vid or 0, info.pid or 0, info.serial_number))
        for info in list_ports.comports()
        if info.serial_number
    ]


if __name__ == "__main__":
    main(*sys.argv[1:])
