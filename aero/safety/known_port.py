"""Identity of a port, so that a hand that was gone is found again and no other device is taken for it."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from serial.tools import list_ports


@dataclass(frozen=True)
class KnownPort:
    """Port with the identity of its device.

    A USB device is identified by its serial number and may reappear under another name. A symbolic link identifies its
    device (`/dev/serial/by-id`, `aero-hil emulate --link`). Any other port is identified by its device file; a
    recreated file may belong to another device.
    """

    name: str
    """Device path or pyserial URL of the port as opened."""
    device: tuple[int, int, str] | None
    """USB vendor, product and serial number; None for other devices."""
    file: tuple[int, ...] | None
    """Identity of the device file; None for a link or a URL."""

    @classmethod
    def of(cls, name: str) -> Self:
        """Return the port `name` with the identity of its current device."""
        path = os.path.realpath(name)
        return cls(name, next((device for port, device in _devices() if port == path), None), _file(name))

    def now(self) -> str:
        """Return the current name of the port.

        Raises:
            ConnectionError: the device is gone; its old name may now belong to another one.
        """
        if self.device is None:
            if self.file is not None and _file(self.name) != self.file:
                raise ConnectionError(
                    f"{self.name}: the port was lost. It has no serial number, so the device with its name may now be "
                    "another one; it is left alone"
                )
            return self.name
        for port, device in _devices():
            if device == self.device:
                return self.name if port == os.path.realpath(self.name) else port
        raise ConnectionError(f"{self.name}: the USB device with the serial number {self.device[2]} is gone")


def _file(name: str) -> tuple[int, ...] | None:
    """Return an identity that changes when a device file is recreated; None for a link or a missing file.

    A new pseudo-terminal reuses the inode number, so its change time is included.
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
    """Return path, and vendor, product and serial number, of every port with a serial number."""
    return [
        (os.path.realpath(info.device), (info.vid or 0, info.pid or 0, info.serial_number))
        for info in list_ports.comports()
        if info.serial_number
    ]
