"""The emulated hand in this process: waiting for bytes moves virtual time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from firmware_emulator.hand import EmulatedHand
from firmware_emulator.kernel import Kernel

WireEntry = tuple[float, Literal[">", "<"], bytes]
"""Virtual time (s), direction (`>` to the hand, `<` from it) and bytes of one write."""


class VirtualLink:
    """A byte stream on virtual time, with the shape of the driver's transport."""

    def __init__(self, kernel: Kernel, send: Callable[[bytes], object], name: str) -> None:
        """Write by `send`; whoever answers calls `arrive`."""
        self.log: list[WireEntry] | None = None
        """Everything that crosses the link, when set to a list."""
        self.name = name
        """What messages call this link."""
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
        """Return as soon as `size` bytes are there, else what came within `timeout` (s) of virtual time.

        Raises:
            ConnectionError: the link was closed.
        """
        self._check_open()
        received = self._received
        if len(received) < size:
            self._wanted = size
            self._kernel.run_until(self._kernel.now + timeout)
            self._wanted = 0
        data = bytes(received[:size])
        del received[:size]
        return data

    def discard_input(self) -> None:
        """Drop every byte received and not yet read."""
        self._received.clear()

    def close(self) -> None:
        """Take nothing more; a second call does nothing."""
        self._closed = True

    def arrive(self, data: bytes) -> None:
        """Take bytes of the other end."""
        if self.log is not None:
            self.log.append((self._kernel.now, "<", data))
        self._received += data
        if self._wanted and len(self._received) >= self._wanted:
            self._kernel.pause()

    def _check_open(self) -> None:
        if self._closed:
            raise ConnectionError(f"{self.name} was closed; open a new link to the hand")


class InProcessLink(VirtualLink):
    """A byte stream to an `EmulatedHand`."""

    def __init__(self, emulated_hand: EmulatedHand, name: str = "emulated") -> None:
        """Connect to a hand; what it sent before is there to be read."""
        super().__init__(emulated_hand.kernel, emulated_hand.receive, name)
        self._hand = emulated_hand
        self._received += emulated_hand.take_output()
        emulated_hand.on_transmit = self.arrive

    def close(self) -> None:
        """Give the hand back; a second call does nothing."""
        if not self._closed:
            self._hand.on_transmit = self._hand.keep
        super().close()
