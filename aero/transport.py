"""Bytes to and from a hand, with the waiting made explicit."""

from __future__ import annotations

from typing import Protocol


class Transport(Protocol):
    """A byte stream to a hand: a serial port, a pseudo-terminal or an emulated hand in this process."""

    @property
    def name(self) -> str:
        """What a person calls this link, for messages (`/dev/ttyACM0`, `emulated`)."""
        ...

    def write(self, data: bytes) -> None:
        """Send all of `data`.

        Raises:
            ConnectionError: the other side is gone.
        """
        ...

    def read(self, size: int, timeout: float) -> bytes:
        """Return as soon as `size` bytes are there, else what came within `timeout` (s), perhaps nothing.

        Raises:
            ConnectionError: the other side is gone.
        """
        ...

    def discard_input(self) -> None:
        """Drop every byte received and not yet read."""
        ...

    def close(self) -> None:
        """Give the link back; a second call does nothing."""
        ...
