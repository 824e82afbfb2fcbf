"""Serial port of the emulated servos, for a physical board that drives them."""

from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import serial


class SerialPort:
    """Servo end of a serial port; interface of `Terminal`.

    The adapter must not echo: the servos would parse their own answers as instructions.
    """

    baud = 1_000_000
    """Rate of the adapter, bit/s."""

    def __init__(self, port: str) -> None:
        """Open a port (device path or pyserial URL) at 1 Mbit/s.

        Raises:
            serial.SerialException: the port cannot be opened; the message names the port.
        """
        try:
            if port.startswith(("socket://", "rfc2217://")) and not urlsplit(port).port:
                raise ValueError("the address has no port")
            # pyserial's rfc2217 does not support a write time-out.
            write_timeout = None if port.startswith("rfc2217://") else 0.1
            self._port = serial.serial_for_url(port, self.baud, timeout=0, write_timeout=write_timeout)
            self._port.fileno()
        except (OSError, ValueError, AttributeError) as error:
            said = f"cannot serve the servo bus on {port!r}: {error}; give a device, or socket://HOST:PORT"
            raise serial.SerialException(said) from error

    @property
    def name(self) -> str:
        """Port as passed to the constructor."""
        return str(self._port.port)

    def fileno(self) -> int:
        """Return the descriptor to wait on."""
        return int(self._port.fileno())

    def read(self) -> bytes:
        """Return the received bytes.

        Raises:
            ConnectionError: the port has disappeared.
        """
        with self._gone():
            return bytes(self._port.read(4096))

    def write(self, data: bytes) -> None:
        """Send an answer.

        Raises:
            ConnectionError: the port has disappeared or does not accept data.
        """
        with self._gone():
            self._port.write(data)

    def close(self) -> None:
        """Close the port; a second call does nothing."""
        self._port.close()

    @contextmanager
    def _gone(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise ConnectionError(f"the servos' port {self.name} was lost: {error}; check its adapter") from error
