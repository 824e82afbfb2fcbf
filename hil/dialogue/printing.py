"""Printing with control characters escaped; a closed pipe does not end the program."""

import errno
import io
import os
import shutil
import sys
import textwrap
from contextlib import suppress
from typing import Any, TextIO

import click

from aero.printable import printable


def echo(text: object = "", *, err: bool = False, nl: bool = True) -> None:
    """Print text, followed by a line feed if `nl`; a standard error on a terminal gets lines that end between words."""
    shown = printable(str(text))
    if err and sys.stderr is not None and sys.stderr.isatty():
        width = shutil.get_terminal_size().columns
        lines = (
            textwrap.fill(line, width, break_long_words=False, break_on_hyphens=False) for line in shown.split("\n")
        )
        shown = "\n".join(lines)
    click.echo(shown, err=err, nl=nl)


CLOSED = {errno.EPIPE, errno.EIO, errno.EBADF}
"""Write errors of a pipe without a reader, a closed terminal, and a closed descriptor."""


class _Output(io.FileIO):
    """Stream that continues into the null device after its reader or terminal closes."""

    def write(self, data: Any) -> int:
        """Write bytes; return their number."""
        try:
            return super().write(data) or 0
        except OSError as error:
            if error.errno not in CLOSED:
                raise
            nowhere = os.open(os.devnull, os.O_WRONLY)
            # replaced in place, because libraries and child processes write to this descriptor too
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            return memoryview(data).nbytes


def survive_closed_streams() -> None:
    """Make output survive a closed pipe or terminal; open the null device for streams closed at startup."""
    _open_missing()
    sys.stdout, sys.stderr = _surviving(sys.stdout), _surviving(sys.stderr)


def _open_missing() -> None:
    """Open a stream for each standard descriptor closed by the shell (`>&-`).

    Otherwise the next opened file, such as a recording, would get the descriptor and all printed text.
    """
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        if getattr(sys, name) is None:
            with suppress(OSError):
                os.fstat(number)
                continue  # already in use by another file
            os.open(os.devnull, os.O_RDWR)  # the lowest free descriptor, which is `number`
            setattr(sys, name, open(number, mode, encoding="utf-8", errors=UNPRINTABLE, closefd=False))  # noqa: SIM115


UNPRINTABLE = "backslashreplace"
"""Error handler for file names outside the terminal's encoding."""


def _surviving(stream: TextIO) -> TextIO:
    """Return a surviving stream in place of Python's own; a test's stream is returned unchanged."""
    buffer = getattr(stream, "buffer", None)
    raw = getattr(buffer, "raw", buffer)  # with PYTHONUNBUFFERED the raw stream is not buffered
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
