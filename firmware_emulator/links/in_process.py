"""The emulated hand in this process: waiting for bytes moves virtual time."""

from __future__ import annotations

from typing import Literal

from firmware_emulator.hand import EmulatedHand
from firmware_emulator.servo_chain import ServoChain

WireEntry = tuple[float, Literal[">", "<"], bytes]
"""Virtual time (s), direction (`>` to the hand, `<` from it) and bytes of one write."""


class InProcessLink:
    """A byte stream to an `EmulatedHand`, with the shape of the driver's transport."""

    def __init__(self, emulated_hand: EmulatedHand, name: str = "emulated") -> None:
        """Connect to a hand; what it sent before is there to be read."""
        self.log: list[WireEntry] | None = None
        """Everything that crosses the link, when set to a list."""
        self._hand = emulated_hand
        self._name = name
        self._received = bytearray(emulated_hand.take_output())
        self._wanted = 0
        self._closed = False
        emulated_hand.on_transmit = self._arrive

    @property
    def name(self) -> str:
        """What messages call this link."""
        return self._name

    def write(self, data: bytes) -> None:
        """Send all of `data`.

        Raises:
            ConnectionError: the link was closed.
        """
        self._check_open()
        if self.log is not None:
            self.log.append((self._hand.kernel.now, ">", bytes(data)))
        self._hand.receive(data)

    def read(self, size: int, timeout: float) -> bytes:
        """Return as soon as `size` bytes are there, else what came within `timeout` (s) of virtual time.

        Raises:
            ConnectionError: the link was closed.
        """
        self._check_open()
        received = self._received
        if len(received) < size:
            kernel = self._hand.kernel
            self._wanted = size
            kernel.run_until(kernel.now + timeout)
            self._wanted = 0
        data = bytes(received[:size])
        del received[:size]
        return data

    def discard_input(self) -> None:
        """Drop every byte received and not yet read."""
        self._received.clear()

    def close(self) -> None:
        """Give the hand back; a second call does nothing."""
        if not self._closed:
            self._closed = True
            self._hand.on_transmit = self._hand.keep

    def _arrive(self, data: bytes) -> None:
        if self.log is not None:
            self.log.append((self._hand.kernel.now, "<", data))
        self._received += data
        if self._wanted and len(self._received) >= self._wanted:
            self._hand.kernel.pause()

    def _check_open(self) -> None:
        if self._closed:
            raise ConnectionError(f"{self._name} was closed; open a new link to the hand")


class BusLink:
    """A master's byte stream on a servo bus, with the shape of the driver's transport; waiting moves virtual time."""

    def __init__(self, chain: ServoChain, baud: int) -> None:
        """Connect a master at a baud rate, bit/s."""
        self._kernel = chain.kernel
        self._received = bytearray()
        self._wanted = 0
        self._port = chain.bus.connect(self._arrive)
        self._port.baud = baud

    @property
    def name(self) -> str:
        """What messages call this link."""
        return "emulated bus"

    def write(self, data: bytes) -> None:
        """Send all of `data`."""
        self._port.write(bytes(data))

    def read(self, size: int, timeout: float) -> bytes:
        """Return as soon as `size` bytes are there, else what came within `timeout` (s) of virtual time."""
        if len(self._received) < size:
            self._wanted = size
            self._kernel.run_until(self._kernel.now + timeout)
            self._wanted = 0
        data = bytes(self._received[:size])
        del self._received[:size]
        return data

    def discard_input(self) -> None:
        """Drop every byte received and not yet read."""
        self._received.clear()

    def close(self) -> None:
        """Do nothing: no resource has to be released."""

    def _arrive(self, data: bytes) -> None:
        self._received += data
        if self._wanted and len(self._received) >= self._wanted:
            self._kernel.pause()
