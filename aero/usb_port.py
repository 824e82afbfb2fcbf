"""Where a USB device's serial port is now: a device that comes back may get another name."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Self

from serial.tools import list_ports


@dataclass(frozen=True)
class UsbPort:
    """A port, and the device behind it where that has a serial number."""

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
