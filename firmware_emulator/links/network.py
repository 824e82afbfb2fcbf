"""RFC 2217 server for the board's port over TCP, with the modem lines that a pseudo-terminal lacks."""

import logging
import socket
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from serial.rfc2217 import PortManager

from firmware_emulator.links import Closing

# The board's USB port is part of the chip, so DTR and RTS are USB requests instead of pins. Source: ESP32-S3 technical
# reference manual, USB Serial/JTAG controller, "reset SoC into download mode"; esptool 5 (`reset.py`) uses these
# states. Opening a port raises DTR, then RTS, and closing drops both at once: neither resets the chip. Dropping DTR
# while RTS is raised restarts the board. Raising both has no effect.
START, DOWNLOAD, RESET = (False, False), (True, False), (False, True)
"""States of (DTR, RTS): select the firmware for the next reset, select download mode, restart the chip."""


class ModemLines:
    """DTR and RTS of one connection."""

    def __init__(self) -> None:
        self._lines = (False, False)
        self.download = False
        """Whether the next reset enters download mode instead of starting the firmware."""

    def set(self, *, dtr: bool | None = None, rts: bool | None = None) -> bool:
        """Change one or both lines; return whether the chip restarts.

        A reset keeps the selected mode: esptool ends the download mode by a reset from (False, False).
        """
        before = self._lines
        self._lines = (before[0] if dtr is None else dtr, before[1] if rts is None else rts)
        if self._lines == before:
            return False
        if self._lines in {START, DOWNLOAD}:
            self.download = self._lines == DOWNLOAD
        return self._lines == RESET


_LOG = logging.getLogger(__name__)
READ_SIZE = 4096
LONGEST_OPTION = 256
"""Size limit of an unterminated Telnet option, bytes; options of RFC 2217 have up to 10."""


class _Board:
    """USB port for pyserial's server: all settings except DTR and RTS are accepted and ignored, as by USB."""

    bytesize, parity, stopbits = 8, "N", 1
    xonxoff = rtscts = dsrdtr = False
    break_condition = False
    # A host always sees these lines raised on such a port.
    cts = dsr = cd = True
    ri = False

    baudrate = 115200
    dtr = rts = False

    def __init__(self, changed: Callable[[str, bool], None]) -> None:
        self._changed = changed

    def __setattr__(self, name: str, value: Any) -> None:
        super().__setattr__(name, value)
        if name in {"dtr", "rts"}:
            self._changed(name, value)

    def reset_input_buffer(self) -> None: ...

    def reset_output_buffer(self) -> None: ...


class NetworkPort(Closing):
    """Device end of a TCP connection, one client at a time; interface of `Terminal`."""

    def __init__(self, host: str, port: int, reset: Callable[[bool], None]) -> None:
        """Listen; `reset(download)` is called when the client's lines request a restart.

        Raises:
            OSError: listening on the address failed.
        """
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0][0]
        self._listener = socket.create_server((host, port), family=family)
        self._listener.setblocking(False)
        self._reset = reset
        self._client: socket.socket | None = None
        self._lines = ModemLines()
        self._manager: PortManager | None = None

    @property
    def name(self) -> str:
        """URL for clients."""
        host, port = self._listener.getsockname()[:2]
        return f"rfc2217://[{host}]:{port}" if ":" in host else f"rfc2217://{host}:{port}"

    def fileno(self) -> int:
        """Return the descriptor to wait on: that of the client, or of the listener without a client."""
        return (self._client or self._listener).fileno()

    def read(self) -> bytes:
        """Accept a client, or return its bytes for the board; port commands are executed here."""
        if self._client is None:
            self._accept()
            return b""
        try:
            data = self._client.recv(READ_SIZE)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data or self._manager is None:
            self.hang_up()
            return b""
        try:
            data = b"".join(self._manager.filter(data))
            unended = len(self._manager.suboption or b"")
        except Exception as error:  # pyserial does not validate options; malformed ones raise anything
            _LOG.info("%s: client disconnected after an invalid Telnet option: %r", self.name, error)
            self.hang_up()
            return b""
        if unended > LONGEST_OPTION:
            _LOG.info("%s: client disconnected after an unterminated Telnet option", self.name)
            self.hang_up()
        return data

    def write(self, data: bytes) -> None:
        """Send to the client; bytes beyond a full buffer are dropped, as on the board."""
        if self._manager is not None:
            self._send(b"".join(self._manager.escape(data)))

    def hang_up(self) -> None:
        """Disconnect the client and clear both lines, as unplugging does."""
        if self._client is not None:
            self._client.close()
        self._client = self._manager = None
        self._lines = ModemLines()

    def close(self) -> None:
        """Disconnect the client and stop listening; a second call does nothing."""
        self.hang_up()
        self._listener.close()

    def _accept(self) -> None:
        try:
            self._client, _ = self._listener.accept()
        except BlockingIOError:
            return
        self._client.setblocking(False)
        self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # PortManager expects a pyserial port and a writable file; both are replaced by minimal objects.
        self._manager = PortManager(_Board(self._change), SimpleNamespace(write=self._send))  # type: ignore[arg-type]

    def _change(self, line: str, value: bool) -> None:
        if self._lines.set(**{line: value}):
            self._reset(self._lines.download)

    def _send(self, data: bytes) -> None:
        if self._client is None:
            return
        rest = memoryview(data)
        while rest:
            try:
                rest = rest[self._client.send(rest) :]
            except OSError:
                return
