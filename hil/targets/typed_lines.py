"""Lines typed to a command that serves a port, read without waiting."""

import os
import select
import sys

from hil.targets.foreground import in_foreground

LARGEST = 4096
"""Size limit of a typed line and of one read, bytes."""


class TypedLines:
    """Complete lines of standard input."""

    def __init__(self, reads: bool) -> None:
        """Read lines if `reads`; a terminal is read only in the foreground."""
        self._reads = reads and sys.stdin is not None
        self._typed = b""
        self._too_long = False

    def taken(self) -> list[str]:
        """Return the lines typed since the last call, without waiting.

        Raises:
            ValueError: a line above `LARGEST` bytes, which is dropped.
        """
        if not self._reads:
            return []
        end = sys.stdin.fileno()
        if not in_foreground(end) or not select.select([end], [], [], 0.0)[0]:
            return []
        data = os.read(end, LARGEST)
        self._reads = bool(data)
        *lines, self._typed = (self._typed + data).split(b"\n")
        if len(self._typed) > LARGEST:
            self._typed = b""
            raise ValueError(f"a line is at most {LARGEST} bytes")
        return [line.decode(errors="replace") for line in lines]

    def drop(self) -> None:
        """Drop what has been typed until now, so that it answers nothing said afterwards."""
        while True:
            before = self._typed
            try:
                lines = self.taken()
            except ValueError:
                continue
            if not lines and self._typed == before:
                self._typed = b""
                return
