"""In-process link to the emulated hand: waiting for bytes advances virtual time."""

from collections.abc import Callable
from typing import Literal

from firmware_emulator.hand import EmulatedHand
from firmware_emulator.kernel import Kernel

WireEntry = tuple[float, Literal[">", "<"], bytes]
"""Virtual time (s), direction (`>` to the hand, `<` from it) and bytes of one write."""


# The driver's reads advance the time, so a run is a pure function of the driver's calls. A thread that advances the
# time beside the driver would make each time-out depend on the system's scheduler.
class VirtualLink:
    """Byte stream on virtual time that implements the driver's transport."""

    def __init__(self, kernel: Kernel, send: Callable[[bytes], object], name: str) -> None:
        """Create a link that writes with `send`; the other end answers by calling `arrive`."""
        self.log: list[WireEntry] | None = None
        """Log of all bytes in both directions; None for no logging."""
        self.name = name
        self._kernel = kernel
        self._send = send
        self._received = bytearray()
        self._wanted = 0
        self._closed = False

    def write(self, data: bytes) -> None:
        """Send all of `data`.

        Raises:
            ConnectionError: the link was closed.
        """
        self._check_open()
        if self.log is not None:
            self.log.append((self._kernel.now, ">", bytes(data)))
        self._send(bytes(data))

    def read(self, size: int, timeout: float) -> bytes:
        """Return `size` bytes as soon as they are available, or fewer after `timeout` (s) of virtual time.

        Raises:
            ConnectionError: the link was closed.
        """
        self._check_open()
        received = self._received
        if len(received) < size:
            self._wanted = size
            try:
                self._kernel.run_until(self._kernel.now + timeout)
            finally:
                self._wanted = 0
        data = bytes(received[:size])
        del received[:size]
        return data

    def discard_input(self) -> None:
        """Drop all unread bytes."""
        self._received.clear()

    def close(self) -> None:
        """Close the link; a second call does nothing."""
        self._closed = True

    def arrive(self, data: bytes) -> None:
        """Receive bytes from the other end."""
        if self.log is not None:
            self.log.append((self._kernel.now, "<", data))
        self._received += data
        if self._wanted and len(self._received) >= self._wanted:
            self._kernel.pause()

    def _check_open(self) -> None:
        if self._closed:
            raise ConnectionError(f"{self.name} was closed; open a new link to the hand")


class InProcessLink(VirtualLink):
    """Byte stream to an `EmulatedHand`."""

    def __init__(self, electronics: EmulatedHand, name: str = "emulated") -> None:
        """Connect to a hand; its earlier, unread output can be read first."""
        super().__init__(electronics.kernel, electronics.receive, name)
        self._electronics = electronics
        self._received += electronics.take_output()
        electronics.on_transmit = self.arrive

    def close(self) -> None:
        """Disconnect from the hand, which buffers its output again; a second call does nothing."""
        if not self._closed:
            self._electronics.on_transmit = self._electronics.keep
        super().close()
