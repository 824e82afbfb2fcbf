"""Transport around a transport."""

from aero.transport import Transport


class Passing:
    """Transport that forwards every call."""

    def __init__(self, behind: Transport) -> None:
        self._behind = behind

    @property
    def name(self) -> str:
        """Display name of the wrapped transport."""
        return self._behind.name

    def write(self, data: bytes) -> None:
        """Send all of `data`."""
        self._behind.write(data)

    def read(self, size: int, timeout: float) -> bytes:
        """Read from the wrapped transport."""
        return self._behind.read(size, timeout)

    def discard_input(self) -> None:
        """Drop every byte received and not yet read."""
        self._behind.discard_input()

    def close(self) -> None:
        """Close the wrapped transport."""
        self._behind.close()
