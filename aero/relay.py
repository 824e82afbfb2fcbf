"""Line between a client's terminal and a port, waited for together, in real time."""

from __future__ import annotations

import os
import select
import threading
from queue import SimpleQueue
from typing import Protocol

from aero.transport import Transport

IDLE_S = 0.05
"""Longest time until the reading thread notices the end of the line, s."""
LARGEST = 4096


class ClientEnd(Protocol):
    """Device end of a client's port, such as a pseudo-terminal."""

    def fileno(self) -> int:
        """Return the descriptor to wait on."""
        ...

    def read(self) -> bytes:
        """Return the bytes written by a client, or b"" if none."""
        ...

    def write(self, data: bytes) -> None:
        """Send to the client; bytes beyond a full buffer are dropped."""
        ...


class GuardedLine(Protocol):
    """Byte stream between a client and a hand's port."""

    def wait(self, longest_s: float) -> tuple[bytes, bytes]:
        """Return the bytes of the client and of the port as soon as there are any; both empty after `longest_s` (s).

        Raises:
            ConnectionError: the port is gone.
        """
        ...

    def to_port(self, data: bytes) -> None:
        """Send all of `data` to the hand; errors as `wait`."""
        ...

    def to_client(self, data: bytes) -> None:
        """Send `data` to the client."""
        ...

    def close(self) -> None:
        """Release the port; a second call does nothing."""
        ...


class PortLine:
    """Line between a client's terminal and a port of any kind."""

    def __init__(self, client: ClientEnd, port: Transport) -> None:
        """Read the port in a thread, because not every port supports `select`."""
        self._client, self._port = client, port
        self._arrived: SimpleQueue[bytes | ConnectionError] = SimpleQueue()
        self._failure: ConnectionError | None = None
        """Error of the port, raised once all bytes before it are delivered."""
        self._awake, self._wake = os.pipe()
        self._ended = threading.Event()
        self._reader = threading.Thread(target=self._read_port, name="port reader", daemon=True)
        self._reader.start()

    def wait(self, longest_s: float) -> tuple[bytes, bytes]:
        """Return the bytes of client and port, see `GuardedLine.wait`."""
        client = self._client.fileno()
        ready, _, _ = select.select([client, self._awake], [], [], max(0.0, longest_s))
        if self._awake in ready:
            os.read(self._awake, LARGEST)
        received = bytearray()
        while self._failure is None and not self._arrived.empty():
            arrived = self._arrived.get()
            if isinstance(arrived, ConnectionError):
                self._failure = arrived
            else:
                received += arrived
        if self._failure is not None and not received:
            raise self._failure
        return self._client.read() if client in ready else b"", bytes(received)

    def to_port(self, data: bytes) -> None:
        """Send all of `data` to the hand, see `GuardedLine.to_port`."""
        self._port.write(data)

    def to_client(self, data: bytes) -> None:
        """Send `data` to the client."""
        self._client.write(data)

    def close(self) -> None:
        """End the thread and close the port; the client's terminal stays. A second call does nothing."""
        self.end()
        self._port.close()

    def end(self) -> None:
        """End the thread; the port stays open. A second call does nothing."""
        if self._awake < 0:
            return
        self._ended.set()
        self._reader.join()
        os.close(self._awake)
        os.close(self._wake)
        self._awake = self._wake = -1

    def _read_port(self) -> None:
        while not self._ended.is_set():
            arrived: bytes | ConnectionError
            try:
                arrived = self._port.read(1, IDLE_S)
                arrived += self._port.read(LARGEST, 0.0)
            except ConnectionError as error:
                arrived = error
            if arrived:
                self._arrived.put(arrived)
                os.write(self._wake, b"\0")
            if isinstance(arrived, ConnectionError):
                return
