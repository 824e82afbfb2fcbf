"""Raw pseudo-terminal that behaves like an unopened serial port.

It stands alone: the emulator serves a hand on it without `aero`, `aero-hil guard` a port without the emulator.
"""

import errno
import os
import select
import struct
import sys
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

try:
    import fcntl
    import termios
    import tty
except ImportError:  # Windows
    fcntl = termios = tty = None  # type: ignore[assignment]

FAST = 1_000_000
TCGETS2 = 0x802C542A
"""Linux ioctl that reads `termios2`, with the baud rate as a number."""
TERMIOS2 = struct.Struct("=4I B19s 2I")
"""Layout of `termios2`: four words of flags, line discipline, characters, baud rates in and out."""
_SERVED: set[str] = set()
"""Terminals served by this process; a process cannot detect its own locks."""


class Terminal:
    """Device end of a pseudo-terminal.

    A new pseudo-terminal echoes and translates line ends, so it is set to raw mode before a client can open it. One
    descriptor of the client end stays open here, so that clients can reconnect without an error on this side.
    """

    def __init__(self, link: Path | None = None) -> None:
        """Open a pseudo-terminal and create `link` as a symbolic link to its client end.

        Raises:
            FileExistsError: `link` exists and is not the stale link of a dead emulator.
            OSError: the system does not support pseudo-terminals.
        """
        if termios is None:
            raise OSError("this system has no pseudo-terminals; serve on a serial port, or use `emulated`")
        self._device, self._client = os.openpty()
        tty.setraw(self._client)
        self._set_fast()
        os.set_blocking(self._device, False)
        self.path = os.ttyname(self._client)
        self._link = link
        _SERVED.add(self.path)
        self._lock()
        if link is not None:
            try:
                _point(link, self.path)
            except OSError:
                self._link = None
                self.close()
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def name(self) -> str:
        """Path for clients: the link, or the terminal without a link."""
        return str(self._link) if self._link is not None else self.path

    def fileno(self) -> int:
        """Return the descriptor to wait on."""
        return self._device

    @property
    def baud(self) -> int:
        """Baud rate set by the client, bit/s; 1 Mbit/s by default, and always on systems other than Linux."""
        if sys.platform != "linux":
            return FAST
        state = fcntl.ioctl(self._client, TCGETS2, bytes(TERMIOS2.size))
        return int(TERMIOS2.unpack(state)[-1])

    def read(self) -> bytes:
        """Return the bytes written by a client, or b"" if none."""
        try:
            return os.read(self._device, 4096)
        except BlockingIOError:
            return b""
        except OSError as error:
            if error.errno != errno.EIO:  # no descriptor of the client end is open
                raise
            return b""

    def write(self, data: bytes) -> None:
        """Send to the client; bytes beyond a full buffer are dropped, as on the board."""
        rest = memoryview(data)
        while rest:
            try:
                rest = rest[os.write(self._device, rest) :]
            except BlockingIOError:
                return

    def has_client(self) -> bool | None:
        """Return whether a program has the client end open; None where the system does not tell.

        Only Linux tells, by a hang-up once no descriptor is open, so this one is closed for a moment. Events of inotify
        cannot be counted instead: two that are alike are merged.
        """
        if sys.platform != "linux":
            return None
        if self._client >= 0:
            os.close(self._client)
        ends = select.poll()
        ends.register(self._device, 0)
        hung_up = bool(ends.poll(0))
        try:
            self._client = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError:  # a client locked the terminal (TIOCEXCL)
            self._client = -1
        else:
            self._lock()
        return not hung_up

    def _lock(self) -> None:
        """Lock the client end, which shows other programs that it is served; elsewhere this would block clients."""
        if sys.platform == "linux":
            with suppress(OSError):  # a program looks at this moment
                fcntl.lockf(self._client, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _set_fast(self) -> None:
        """Set the default baud rate of clients to that of the servo bus."""
        if hasattr(termios, "B1000000"):
            settings = termios.tcgetattr(self._client)
            settings[4] = settings[5] = termios.B1000000
            termios.tcsetattr(self._client, termios.TCSANOW, settings)

    def close(self) -> None:
        """Close the terminal and remove the link; a second call does nothing."""
        if self._device < 0:
            return
        if self._link is not None and self._link.is_symlink() and str(self._link.readlink()) == self.path:
            self._link.unlink()
        _SERVED.discard(self.path)
        os.close(self._device)
        if self._client >= 0:
            os.close(self._client)
        self._device = self._client = -1


def _point(link: Path, target: str) -> None:
    if link.is_symlink() and str(link.readlink()).startswith("/dev/") and not _is_served(str(link.readlink()), target):
        link.unlink()
    if link.exists() or link.is_symlink():
        raise FileExistsError(f"{link} exists already; stop what serves it, or remove it, or choose another path")
    link.symlink_to(target)


def _is_served(path: str, new: str) -> bool:
    """Return whether the terminal at `path` is in use, so that a link to it is not the stale link of a dead emulator.

    The system reuses terminal numbers, for ours (`new`) or another program's, so a stale link may point to an existing
    terminal.
    """
    if path == new or not Path(path).exists():
        return False
    if sys.platform != "linux" or not path.startswith("/dev/pts/") or path in _SERVED:
        return True
    try:
        terminal = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError:
        return False  # reused by another user
    try:
        fcntl.lockf(terminal, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(terminal)
    return False
