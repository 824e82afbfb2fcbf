"""Interface of a byte stream to a hand, with an explicit time-out on every read."""

from typing import Protocol


class Transport(Protocol):
    """Byte stream to a hand: a serial port, a pseudo-terminal or an emulated hand in this process."""

    @property
    def name(self) -> str:
        """Display name of the link, for messages (`/dev/ttyACM0`, `emulated`)."""
        ...

    def write(self, data: bytes) -> None:
        """Send all of `data`.

        Raises:
            ConnectionError: the link is lost.
        """
        ...

    def read(self, size: int, timeout: float) -> bytes:
        """Return `size` bytes as soon as received, or the fewer (possibly none) received within `timeout` (s).

        Raises:
            ConnectionError: the link is lost.
        """
        ...

    def discard_input(self) -> None:
        """Drop all received, unread bytes."""
        ...

    def close(self) -> None:
        """Release the link; a second call does nothing."""
        ...
