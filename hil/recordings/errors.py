"""Errors about files and recordings. None of them says anything about the hand."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from aero.exit_code import Exit

FULL_DISK = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
"""Error numbers of a disk, a quota or a file that takes no more."""


class CannotBeWrittenError(OSError):
    """A result could not be written, for example because the disk is full; the message names the file."""


class UnwritablePlaceError(OSError):
    """Results cannot go to a place, which was tried before there were any; the message names it."""


class CannotBeMeasuredError(ValueError):
    """A recording lacks what a measurement needs; the message says what."""

    exit_code = Exit.USAGE


class NotOneHandError(ValueError):
    """Recordings that cannot be judged as one run; the message names two of them and says why."""

    exit_code = Exit.USAGE


class UnusableFileError(ValueError):
    """A file that cannot be used as a recording; the message names it and says why."""

    exit_code = Exit.USAGE


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn every `OSError` of the block, in which nothing but `path` is written, into `CannotBeWrittenError`."""
    try:
        yield
    except CannotBeWrittenError:
        raise
    except OSError as error:
        raise unwritable(path, error) from error


def unwritable(path: Path, error: OSError) -> CannotBeWrittenError:
    """Return what to say of an error of the system when nothing but `path` was written."""
    if isinstance(error, CannotBeWrittenError):
        return error
    return CannotBeWrittenError(error.errno, f"cannot be written: {error.strerror or error}", str(path))
