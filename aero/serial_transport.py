"""A hand on a serial port, or on anything else that pyserial can open by URL."""

from __future__ import annotations

import errno
import os
import weakref
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import serial
from serial.tools import list_ports

try:
    import fcntl
    import termios
except ImportError:  # Windows, where a port has one user anyway
    fcntl = termios = None  # type: ignore[assignment]

from aero.clock import Deadline, WallClock

BAUD_RATE = 921600
"""What the vendor's software asks for. The board's USB port ignores it; a UART bridge in between might not."""
_POLL_S = 0.01
_WRITE_TIMEOUT_S = 1.0

_REMEDIES = {
    errno.ENOENT: "there is no such port; is the hand plugged in?",
    errno.EACCES: "access denied; on Linux join the group that owns the port (often dialout) and log in again",
    errno.EAGAIN: "another program holds the port; close it first",
    errno.EBUSY: "another program holds the port; close it first",
}


class SerialTransport:
    """A `Transport` over pyserial; make one with `open`.

    The control lines stay as pyserial sets them on opening: raising DTR and RTS together does not reset an ESP32-S3,
    touching them one by one can, and on a pseudo-terminal it fails.
    """

    def __init__(self, port: serial.Serial, name: str) -> None:
        self._port = port
        self._name = name
        _ALL.add(self)

    @classmethod
    def open(cls, port_or_url: str, baud_rate: int = BAUD_RATE) -> SerialTransport:
        """Open a device path or pyserial URL (`/dev/ttyACM0`, `COM5`, `rfc2217://bench:4000`), locked where possible.

        A bus adapter, other than a hand, needs the baud rate of what is behind it, bit/s.

        Raises:
            ConnectionError: no such port, no permission, in use, or no answer from a network port.
            ValueError: a URL scheme that pyserial does not know.
        """
        try:
            port = serial.serial_for_url(
                port_or_url, baudrate=baud_rate, timeout=_POLL_S, write_timeout=_WRITE_TIMEOUT_S, exclusive=True
            )
        except OSError as error:
            remedy = _REMEDIES.get(error.errno or 0, f"{error}.")
            raise ConnectionError(f"cannot open {port_or_url}: {remedy} {_ports_here()}") from error
        _refuse_others(port, "TIOCEXCL")
        return cls(port, port_or_url)

    @property
    def name(self) -> str:
        """The path or URL it was opened with."""
        return self._name

    def write(self, data: bytes) -> None:
        """Send all of `data` or fail; see `Transport.write`."""
        with self._link_errors("write to"):
            self._port.write(data)

    def read(self, size: int, timeout: float) -> bytes:
        """Return up to `size` bytes within `timeout` (s), which may be exceeded by 10 ms; see `Transport.read`."""
        deadline = Deadline.after(WallClock(), timeout)
        received = bytearray()
        with self._link_errors("read from"):
            while len(received) < size:
                waiting = self._port.in_waiting
                if waiting:
                    received += self._port.read(min(waiting, size - len(received)))
                elif deadline.expired:
                    break
                else:
                    received += self._port.read(1)
        return bytes(received)

    def discard_input(self) -> None:
        """Drop what has arrived; see `Transport.discard_input`."""
        with self._link_errors("read from"):
            while waiting := self._port.in_waiting:
                self._port.read(waiting)

    def close(self) -> None:
        """Close the port; a second call does nothing."""
        with suppress(OSError):  # an unplugged port has nothing left to give back
            if self._port.is_open:
                _refuse_others(self._port, "TIOCNXCL")
        self._port.close()

    def disown(self) -> None:
        """Let go of the port after a fork, in the child, as if it had never been open there.

        A network port stays open, because closing it would end the parent's connection too.
        """
        if isinstance(self._port, serial.Serial) and self._port.is_open:
            self._port.close()

    @contextmanager
    def _link_errors(self, action: str) -> Iterator[None]:
        if not self._port.is_open:
            raise ConnectionError(f"cannot {action} {self._name}: it has been closed by this program")
        try:
            yield
        except serial.SerialTimeoutException as error:
            raise ConnectionError(
                f"cannot {action} {self._name}: it took no data for {_WRITE_TIMEOUT_S:g} s; "
                "is the board powered and its firmware running?"
            ) from error
        except OSError as error:
            raise ConnectionError(f"cannot {action} {self._name}: {error}; has the hand been unplugged?") from error


_ALL: weakref.WeakSet[SerialTransport] = weakref.WeakSet()


def _disown_all() -> None:
    for transport in list(_ALL):
        transport.disown()


if hasattr(os, "register_at_fork"):  # Windows has no fork
    os.register_at_fork(after_in_child=_disown_all)


def _refuse_others(port: serial.Serial, request: str) -> None:
    """Close the port to later programs (TIOCEXCL), or open it again (TIOCNXCL), where the system can do that.

    pyserial's own lock keeps out programs that ask for it; the vendor's software does not. A pseudo-terminal is left
    alone: it would stay closed if this program were killed, because the emulator behind it keeps it in use.
    """
    if termios is not None and isinstance(port, serial.Serial) and not _is_pseudo_terminal(port):
        fcntl.ioctl(port.fileno(), getattr(termios, request))


def _is_pseudo_terminal(port: serial.Serial) -> bool:
    return os.path.realpath(str(port.port)).startswith("/dev/pts/")


def _ports_here() -> str:
    ports = ", ".join(sorted(info.device for info in list_ports.comports()))
    return f"Serial ports on this machine: {ports or 'none'}."
