"""The one way to write a file: another program sees the old one or the whole new one, and a full disk costs neither.

A link in place of the file is replaced by it; what the link points at stays as it is. A file that is mounted by itself
cannot be replaced and is overwritten.
"""

from __future__ import annotations

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
    """Yield the path of a draft in the same folder, with the same ending, that becomes `path` when all went well.

    Raises:
        OSError: it cannot be written.
    """
    draft = path.with_name(f".{os.getpid()}.{path.name}")
    try:
        draft.unlink(missing_ok=True)
        yield draft
        _put(draft, path)
    except BaseException as error:
        draft.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno and error.filename in (None, str(draft)):
            raise OSError(error.errno, error.strerror, str(path)) from error  # a full disk names no file
        raise


def _put(draft: Path, path: Path) -> None:
    """Replace `path` by the draft; a file that is a mount of its own, as in a container, is overwritten instead."""
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
    """Write a text file, UTF-8; what no UTF-8 can hold, as of the name of a file, is written as an escape.

    Raises:
        OSError: it cannot be written.
    """
    with whole(path) as draft, draft.open("x", encoding="utf-8", errors="backslashreplace") as stream:
        stream.write(text)


def begin_file(path: Path, buffering: int = -1) -> BinaryIO:
    """Open an empty file at `path` that is written while work continues, in place of a file or a link there.

    Raises:
        OSError: it cannot be written, or what is there is neither a file nor a link.
    """
    try:
        found = path.lstat().st_mode
    except FileNotFoundError:
        return path.open("xb", buffering=buffering)
    if not (stat.S_ISREG(found) or stat.S_ISLNK(found)):
        raise OSError(f"{path} is there already and no regular file; choose another name")
    try:
        path.unlink()
    except OSError as error:
        if error.errno != errno.EBUSY:
            raise
        return path.open("wb", buffering=buffering)  # a mount of its own
    return path.open("xb", buffering=buffering)
