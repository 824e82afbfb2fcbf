"""Typed answers of a dialogue: lines of a terminal in the foreground, or of a script."""

import io
import os
import select
import sys
from contextlib import suppress

from hil.dialogue.asker import READ_S
from hil.dialogue.printing import echo
from hil.targets.foreground import in_foreground

try:
    import termios
except ImportError:  # Windows
    termios = None  # type: ignore[assignment]

LOOK_S = 1.0
"""Poll period for the foreground and for a vanished page, s."""
LARGEST = 4096
"""Size limit of one read, bytes."""


class TypedInput:
    """Standard input of a dialogue.

    A terminal's input from before its question was shown is dropped. All lines of a script count, because it is
    written in advance. Where standard input cannot be polled, as on Windows, reading a line blocks.
    """

    def __init__(self) -> None:
        """Use the present standard input."""
        self._end = _pollable()
        self._buffer = b""
        self._early = self._told = False
        self.over = sys.stdin is None
        """True once no further line can come."""

    @property
    def is_terminal(self) -> bool:
        """Whether standard input is a terminal."""
        return self._end is not None and os.isatty(self._end)

    def settle(self) -> None:
        """Drop a terminal's input until none has come for `READ_S`; to be called after a question is shown.

        In the background, where a flush would stop the process, the input is dropped on the return to the foreground.
        """
        self._early = self.is_terminal
        if self._end is None or not self._early or not self._may_read():
            return
        self._buffer = b""
        with suppress(termios.error):  # hung up
            termios.tcflush(self._end, termios.TCIFLUSH)
            # a paste arrives in pieces, and a key that is held down repeats
            while select.select([self._end], [], [], READ_S)[0]:
                termios.tcflush(self._end, termios.TCIFLUSH)
            termios.tcflush(self._end, termios.TCIFLUSH)  # a part of a line, which is not readable
        self._early = False

    def line(self, wake: int | None = None) -> str | None:
        """Return the next line; None after `LOOK_S`, and at the end.

        Args:
            wake: descriptor of a pipe whose bytes end the wait; they are consumed.

        Raises:
            KeyboardInterrupt: the end of a terminal's input.
        """
        if self._end is None and not self.over:
            return self._blocking()
        if self._early and self._may_read():
            self.settle()
        if b"\n" not in self._buffer:
            self._wait(wake)
        if b"\n" not in self._buffer and not (self.over and self._buffer):
            return None
        line, _, self._buffer = self._buffer.partition(b"\n")
        return line.decode(errors="replace")

    def _may_read(self) -> bool:
        return self._end is not None and in_foreground(self._end)

    def _wait(self, wake: int | None) -> None:
        """Read what is typed within `LOOK_S`."""
        reads = not self.over and self._may_read()
        if not (reads or self.over or self._told):
            self._told = True
            echo("in the background: `fg` brings the question to the terminal", err=True)
        ends = [end for end in (self._end if reads else None, wake) if end is not None]
        ready = select.select(ends, [], [], LOOK_S)[0]
        if wake in ready:
            os.read(wake, LARGEST)
        elif ready:
            self._read()

    def _read(self) -> None:
        assert self._end is not None
        try:
            data = os.read(self._end, LARGEST)
        except OSError:  # hung up, or in the background since the last look
            if not self._may_read():
                return
            data = b""
        self._buffer += data
        self.over = not data
        if self.over and self.is_terminal:
            raise KeyboardInterrupt

    def _blocking(self) -> str | None:
        line = sys.stdin.readline()
        self.over = not line
        return line.rstrip("\r\n") if line else None


def _pollable() -> int | None:
    """Return the descriptor of standard input; None without one that `select` accepts."""
    if os.name != "posix" or sys.stdin is None:
        return None
    try:
        return sys.stdin.fileno()
    except (io.UnsupportedOperation, ValueError):  # replaced by a text in memory, or closed
        return None
