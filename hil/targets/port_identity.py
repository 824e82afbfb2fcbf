"""Identity of a USB port, which shows whether another board, cable or socket was connected."""

import os
from dataclasses import dataclass

from serial.tools.list_ports import comports

OWN_NUMBER = 8
"""Smallest length of a serial number of one board only; cheaper adapters share a short one, such as `0001`."""


@dataclass(frozen=True)
class PortIdentity:
    """Serial number and USB path of a port; each is empty if unknown."""

    serial_number: str = ""
    location: str = ""
    """Bus and sockets down to the port, such as `1-2.4`; a dot is a hub."""

    @classmethod
    def of(cls, port: str) -> "PortIdentity":
        """Return the present identity of a port."""
        device = os.path.realpath(port)
        found = next((one for one in comports() if one.device == device), None)
        return cls() if found is None else cls(found.serial_number or "", (found.location or "").partition(":")[0])

    def same_board(self, now: "PortIdentity") -> bool:
        """Return whether the port is known to be of the same board."""
        return len(self.serial_number) >= OWN_NUMBER and self.serial_number == now.serial_number

    def same_hub(self, now: "PortIdentity") -> bool:
        """Return whether the port is known to be at the same socket of a hub."""
        return "." in self.location and self.location == now.location
