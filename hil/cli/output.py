"""The one way to print: control characters of files and boards are shown as escapes, and a closed pipe ends nothing."""

from __future__ import annotations

import io
import os
import re
import sys
from typing import Any, TextIO

import click

UNSAFE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""What would move the cursor, change the terminal or the direction of writing, or cannot be written as UTF-8."""


def printable(text: str) -> str:
    """Return text as it can be shown: a recording, a unit or a board may hold escape sequences of a terminal."""
    return UNSAFE.sub(lambda found: ascii(found[0])[1:-1], text)


def echo(text: object = "", *, err: bool = False) -> None:
    """Print a line."""
    click.echo(printable(str(text)), err=err)


class _Pipe(io.FileIO):
    """A file that goes to nowhere once nobody reads it any more; what a command does is not ended by that."""

    def write(self, data: Any) -> int:
        """Write bytes; returns how many."""
        try:
            return super().write(data) or 0
        except BrokenPipeError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            # In its place, because libraries and child processes print there too.
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            return memoryview(data).nbytes


def survive_closed_pipes() -> None:
    """Let a closed pipe end the printing and nothing else, on standard output and standard error."""
    sys.stdout, sys.stderr = _surviving(sys.stdout), _surviving(sys.stderr)


UNPRINTABLE = "backslashreplace"
"""How the name of a file is shown that the terminal's encoding does not have."""


def _surviving(stream: TextIO) -> TextIO:
    """Return a stream like Python's own whose pipe may be closed; one of a test as it is."""
    buffer = getattr(stream, "buffer", None)
    raw = getattr(buffer, "raw", buffer)  # with PYTHONUNBUFFERED there is nothing between
    if not isinstance(stream, io.TextIOWrapper) or type(raw) is not io.FileIO:
        return stream
    stream.reconfigure(errors=UNPRINTABLE)
    if stream.isatty():
        return stream
    pipe = _Pipe(stream.fileno(), "wb", closefd=False)
    return io.TextIOWrapper(
        pipe if buffer is raw else io.BufferedWriter(pipe),
        stream.encoding,
        UNPRINTABLE,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )
