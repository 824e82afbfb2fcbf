"""The one way to print: control characters of files and boards are shown as escapes, and a closed pipe ends nothing."""

from __future__ import annotations

import errno
import io
import os
import sys
from contextlib import suppress
from typing import Any, TextIO

import click

from aero.printable import printable


def echo(text: object = "", *, err: bool = False) -> None:
    """Print a line."""
    click.echo(printable(str(text)), err=err)


CLOSED = {errno.EPIPE, errno.EIO, errno.EBADF}
"""Errors of writing to a pipe without a reader, a closed terminal, a closed descriptor."""


class _Output(io.FileIO):
    """A stream that continues into the null device when its reader or its terminal closes."""

    def write(self, data: Any) -> int:
        """Write bytes; returns how many."""
        try:
            return super().write(data) or 0
        except OSError as error:
            if error.errno not in CLOSED:
                raise
            nowhere = os.open(os.devnull, os.O_WRONLY)
            # In its place, because libraries and child processes print there too.
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            return memoryview(data).nbytes


def survive_closed_streams() -> None:
    """Let a closed pipe or terminal end the printing only; open the null device for streams closed at the start."""
    _open_missing()
    sys.stdout, sys.stderr = _surviving(sys.stdout), _surviving(sys.stderr)


def _open_missing() -> None:
    """Give Python a stream for each standard descriptor that a shell closed (`>&-`).

    Otherwise the next file that is opened, such as a recording, takes the descriptor and whatever is printed to it.
    """
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        if getattr(sys, name) is None:
            with suppress(OSError):
                os.fstat(number)
                continue  # in use by another file already
            os.open(os.devnull, os.O_RDWR)  # the lowest free descriptor, which is this one
            setattr(sys, name, open(number, mode, encoding="utf-8", errors=UNPRINTABLE, closefd=False))  # noqa: SIM115


UNPRINTABLE = "backslashreplace"
"""How the name of a file is shown that the terminal's encoding does not have."""


def _surviving(stream: TextIO) -> TextIO:
    """Return a stream like Python's own whose reader may close; a stream of a test unchanged."""
    buffer = getattr(stream, "buffer", None)
    raw = getattr(buffer, "raw", buffer)  # with PYTHONUNBUFFERED there is nothing between
    if not isinstance(stream, io.TextIOWrapper) or type(raw) is not io.FileIO:
        return stream
    stream.reconfigure(errors=UNPRINTABLE)
    pipe = _Output(stream.fileno(), "wb", closefd=False)
    return io.TextIOWrapper(
        pipe if buffer is raw else io.BufferedWriter(pipe),
        stream.encoding,
        UNPRINTABLE,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )
