"""Errors about files and recordings, never about the hand."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from aero.exit_code import Exit

FULL_DISK = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
"""Error numbers of a full disk, an exhausted quota or a file at its size limit."""


class CannotBeWrittenError(OSError):
    """A result could not be written, for example to a full disk; the message names the file."""


class UnwritablePlaceError(OSError):
    """An output folder or file failed the write test before the run; the message names the path."""


class CannotBeMeasuredError(ValueError):
    """A recording lacks data for a measurement; the message names the missing data."""

    exit_code = Exit.USAGE


class NotOneHandError(ValueError):
    """Recordings cannot be judged as one run; the message names two of them and the reason."""

    exit_code = Exit.USAGE


class UnusableFileError(ValueError):
    """A file cannot be used as a recording; the message names the file and the reason."""

    exit_code = Exit.USAGE


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Convert each `OSError` of the block, which may write only `path`, to `CannotBeWrittenError`."""
    try:
        yield
    except CannotBeWrittenError:
        raise
    except OSError as error:
        raise unwritable(path, error) from error


def unwritable(path: Path, error: OSError) -> CannotBeWrittenError:
    """Return the `CannotBeWrittenError` for an `OSError` of writing `path`."""
    if isinstance(error, CannotBeWrittenError):
        return error
    return CannotBeWrittenError(error.errno, f"cannot be written: {error.strerror or error}", str(path))
