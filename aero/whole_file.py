"""Atomic file writes: other programs see the old file or the complete new one, and a full disk damages neither.

A symbolic link at the path is replaced; its target does not change. A file that is its own mount cannot be replaced and
is overwritten.
"""

import errno
import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `path`, with its suffix; renamed to `path` if the block succeeds.

    Raises:
        OSError: the file cannot be written.
    """
    draft = path.with_name(f".{os.getpid()}.{path.name}")
    try:
        draft.unlink(missing_ok=True)
        yield draft
        _put(draft, path)
    except BaseException as error:
        draft.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno and error.filename in (None, str(draft)):
            raise OSError(error.errno, error.strerror, str(path)) from error  # a full disk's error has no name
        raise


def _put(draft: Path, path: Path) -> None:
    """Replace `path` by the draft; overwrite a file that is its own mount, as in a container."""
    try:
        draft.replace(path)
    except OSError as error:
        if error.errno != errno.EBUSY or not path.is_file():
            raise
        with draft.open("rb") as source, path.open("r+b") as stream:
            shutil.copyfileobj(source, stream)
            stream.truncate()
        draft.unlink()


def write_whole(path: Path, text: str) -> None:
    """Write a UTF-8 text file atomically; characters that UTF-8 cannot encode, as in file names, become escapes.

    Raises:
        OSError: the file cannot be written.
    """
    with whole(path) as draft, draft.open("x", encoding="utf-8", errors="backslashreplace") as stream:
        stream.write(text)


def begin_file(path: Path, buffering: int = -1) -> BinaryIO:
    """Open an empty file at `path` for incremental writing; replaces an existing file or link.

    Raises:
        OSError: the file cannot be written, or the path exists and is neither a file nor a link.
    """
    try:
        found = path.lstat().st_mode
    except FileNotFoundError:
        return path.open("xb", buffering=buffering)
    if not (stat.S_ISREG(found) or stat.S_ISLNK(found)):
        raise OSError(f"{path} exists and is not a regular file; choose another name")
    try:
        path.unlink()
    except OSError as error:
        if error.errno != errno.EBUSY:
            raise
        return path.open("wb", buffering=buffering)  # a mount of its own
    return path.open("xb", buffering=buffering)
