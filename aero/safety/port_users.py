"""Number of programs that have a port open, so that a guard notices the end of a client at once."""

import ctypes
import os
import struct
import sys

OPENED, CLOSED = 0x20, 0x18
"""Event masks of inotify: IN_OPEN, and IN_CLOSE_WRITE with IN_CLOSE_NOWRITE. Source: Linux, uapi/linux/inotify.h."""
EVENT = struct.Struct("iIII")
LARGEST = 65536


class PortUsers:
    """Count of the open descriptors of a file, by inotify; only Linux has it."""

    # The device end of a pseudo-terminal shows the end of its last client only if no other descriptor of the client
    # end is open. The terminal keeps one, which holds its lock and lets clients come and go.
    def __init__(self, path: str) -> None:
        """Count from 0; descriptors that are open already are not counted."""
        self._users = 0
        self._events = -1
        if sys.platform != "linux":
            return
        libc = ctypes.CDLL(None, use_errno=True)
        self._events = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        if self._events >= 0 and libc.inotify_add_watch(self._events, os.fsencode(path), OPENED | CLOSED) < 0:
            self.close()

    def count(self) -> int | None:
        """Return the number of descriptors opened since and not closed; None where the system does not tell."""
        if self._events < 0:
            return None
        try:
            events = os.read(self._events, LARGEST)
        except BlockingIOError:
            return self._users
        while events:
            _, mask, _, length = EVENT.unpack_from(events)
            self._users += bool(mask & OPENED) - bool(mask & CLOSED)
            events = events[EVENT.size + length :]
        return self._users

    def close(self) -> None:
        """Release the descriptor; a second call does nothing."""
        if self._events >= 0:
            os.close(self._events)
            self._events = -1
