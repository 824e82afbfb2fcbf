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
    if doubt is not None:
        sys.exit(f"{port}: the program has ended, and the hand may not be open. {SWITCH_OFF}, because {doubt}")


def open_what_was_left(
    connect: Callable[[], AeroHand], clock: Clock, thresholds: Thresholds, *, settable: bool
) -> str | None:
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
                return str(error)
        clock.sleep_until(clock.now() + RETRY_S)


@dataclass(frozen=True)
class UsbPort:
    """A port, and the device behind it: a device that comes back may get another name."""

    name: str
    """Device path or pyserial URL by which it was opened."""
    device: tuple[int, int, str] | None
    """Vendor, product and serial number; None for what is no USB device, or has none."""

    @classmethod
    def of(cls, name: str) -> Self:
        """Take down which device is behind a port."""
        path = os.path.realpath(name)
        return cls(name, next((device for port, device in _devices() if port == path), None))

    def now(self) -> str:
        """Return the name that the port has now.

        Raises:
            ConnectionError: no port belongs to the device. What has its old name by now is another one.
        """
        if self.device is None:
            return self.name
        for port, device in _devices():
            if device == self.device:
                return self.name if port == os.path.realpath(self.name) else port
        raise ConnectionError(f"{self.name}: the USB device with the serial number {self.device[2]} is gone")


def _devices() -> list[tuple[str, tuple[int, int, str]]]:
    """Return the path of every port whose device has a serial number, with vendor, product and number."""
    return [
        (os.path.realpath(info.device), (info.vid or 0, info.pid or 0, info.serial_number))
        for info in list_ports.comports()
        if info.serial_number
    ]


if __name__ == "__main__":
    main(*sys.argv[1:])
