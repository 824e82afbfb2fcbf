"""Transport over a serial port or any other pyserial URL."""

from __future__ import annotations

import errno
import os
import weakref
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from urllib.parse import urlsplit
from warnings import catch_warnings, simplefilter

import serial
from serial.tools import list_ports

try:
    import fcntl
    import termios
except ImportError:  # Windows, which opens every port exclusively
    fcntl = termios = None  # type: ignore[assignment]

from aero.clock import Deadline, WallClock

BAUD_RATE = 921600
"""Baud rate of the vendor's software, bit/s. The board's USB port ignores it; a UART bridge in between may not."""
_POLL_S = 0.01
_WRITE_TIMEOUT_S = 1.0

_REMEDIES = {
    errno.ENOENT: "there is no such port; is the hand plugged in?",
    errno.EACCES: "access denied; on Linux join the group that owns the port (often dialout) and log in again",
    errno.EAGAIN: "another program holds the port; close it first",
    errno.EBUSY: "another program holds the port; close it first",
}


class SerialTransport:
    """`Transport` over pyserial; create one with `open`.

    The control lines keep the state that pyserial sets on opening. Raising DTR and RTS together does not reset an
    ESP32-S3; changing them one by one can, and fails on a pseudo-terminal.
    """

    def __init__(self, port: serial.Serial, name: str) -> None:
        self.name = name
        """Path or URL of the port as opened."""
        self._port = port
        self._closed = False
        _ALL.add(self)

    @classmethod
    def open(cls, port_or_url: str, baud_rate: int = BAUD_RATE) -> SerialTransport:
        """Open a device path or pyserial URL (`/dev/ttyACM0`, `COM5`, `rfc2217://bench:4000`), locked where possible.

        Unlike a hand, a bus adapter needs the baud rate of its bus, bit/s.

        Raises:
            ConnectionError: no such port, no permission, in use, or no answer from a network port.
            ValueError: a URL scheme that pyserial does not know, or a network address without a port.
        """
        # pyserial's rfc2217 has no write timeout: its socket times out after 5 s.
        write_timeout = None if port_or_url.startswith("rfc2217://") else _WRITE_TIMEOUT_S
        _check_address(port_or_url)
        try:
            with catch_warnings():
                simplefilter("ignore", DeprecationWarning)  # of pyserial 3.5's rfc2217; an error in some test suites
                port = serial.serial_for_url(
                    port_or_url, baudrate=baud_rate, timeout=_POLL_S, write_timeout=write_timeout, exclusive=True
                )
        except OSError as error:
            raise _cannot_open(port_or_url, error) from error
        try:
            _refuse_others(port, "TIOCEXCL")
        except OSError as error:
            port.close()
            raise _cannot_open(port_or_url, error) from error
        return cls(port, port_or_url)

    def write(self, data: bytes) -> None:
        """Send all of `data` or fail; see `Transport.write`."""
        with self._link_errors("write to"):
            self._port.write(data)

    def read(self, size: int, timeout: float) -> bytes:
        """Return up to `size` bytes within `timeout` (s), up to 10 ms late; see `Transport.read`."""
        received = bytearray()
        with self._link_errors("read from"):
            if timeout <= 0.0 and not self._port.in_waiting:
                return b""
            deadline = Deadline.after(WallClock(), timeout)
            while len(received) < size:
                if not deadline.expired:
                    received += self._port.read(size - len(received))  # waits 10 ms at most
                elif waiting := self._port.in_waiting:  # `socket://` reports 1 for any number
                    received += self._port.read(min(waiting, size - len(received)))
                else:
                    break
        return bytes(received)

    def discard_input(self) -> None:
        """Drop all received bytes; see `Transport.discard_input`."""
        with self._link_errors("read from"):
            while waiting := self._port.in_waiting:
                self._port.read(waiting)

    def close(self) -> None:
        """Close the port; a second call does nothing."""
        self._closed = True
        with suppress(OSError):  # an unplugged port has nothing left to release
            if self._port.is_open:
                _refuse_others(self._port, "TIOCNXCL")
        self._port.close()

    def disown(self) -> None:
        """Close the port's descriptor in a forked child, without an effect on the parent.

        A network port remains open, because closing it would end the parent's connection too.
        """
        if isinstance(self._port, serial.Serial) and self._port.is_open:
            self._port.close()

    @contextmanager
    def _link_errors(self, action: str) -> Iterator[None]:
        """Convert exceptions of pyserial to `ConnectionError`, also those of a port closed by another thread."""
        if self._closed or not self._port.is_open:
            raise ConnectionError(f"cannot {action} {self.name}: it has been closed by this program")
        try:
            yield
        except (OSError, ValueError, TypeError, AttributeError) as error:
            if self._closed:
                why = "it has been closed by this program"
            elif isinstance(error, serial.SerialTimeoutException):
                why = f"it took no data for {_WRITE_TIMEOUT_S:g} s; is the board powered and its firmware running?"
            elif isinstance(error, OSError):
                why = f"{error}; has the hand been unplugged?"
            else:  # `select` takes no descriptor beyond 1023
                why = f"{error}. It was opened while this program had more than 1000 files open; open the hand first."
            raise ConnectionError(f"cannot {action} {self.name}: {why}") from error


_ALL: weakref.WeakSet[SerialTransport] = weakref.WeakSet()


def _disown_all() -> None:
    for transport in list(_ALL):
        transport.disown()


if hasattr(os, "register_at_fork"):  # Windows has no fork
    os.register_at_fork(after_in_child=_disown_all)


def _refuse_others(port: serial.Serial, request: str) -> None:
    """Lock the port against later programs (TIOCEXCL), or unlock it (TIOCNXCL), where the system supports that.

    pyserial's own lock is advisory, and the vendor's software ignores it. Pseudo-terminals are skipped: the emulator
    keeps its end open, so the lock would survive if this program were killed.
    """
    if termios is not None and isinstance(port, serial.Serial) and not _is_pseudo_terminal(port):
        fcntl.ioctl(port.fileno(), getattr(termios, request))


def _is_pseudo_terminal(port: serial.Serial) -> bool:
    return os.path.realpath(str(port.port)).startswith("/dev/pts/")


def _check_address(port_or_url: str) -> None:
    """Refuse a network address without a port, for which pyserial's own message is useless."""
    scheme, _, address = port_or_url.partition("://")
    if scheme not in {"socket", "rfc2217"}:
        return
    try:
        port = urlsplit(port_or_url).port
    except ValueError:
        port = None
    if not port:
        raise ValueError(
            f"{port_or_url}: a network port is given as {scheme}://HOST:PORT, with a port of 1 to 65535; "
            f"add it, as in {scheme}://{urlsplit(f'//{address}').hostname or 'bench'}:4000."
        )


def _cannot_open(port_or_url: str, error: OSError) -> ConnectionError:
    remedy = _REMEDIES.get(error.errno or 0, f"{error}.")
    return ConnectionError(f"cannot open {port_or_url}: {remedy} {_ports_here()}")


def _ports_here() -> str:
    ports = ", ".join(sorted(info.device for info in list_ports.comports()))
    return f"Serial ports on this machine: {ports or 'none'}."
