"""Reading of user-supplied files: only regular files of bounded size and nesting.

Opening a pipe would block, and reading a device would never end.
"""

from __future__ import annotations

import json
import math
import os
import stat
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

if TYPE_CHECKING:
    from numpy.typing import NDArray

MIB = 2**20
LFS_POINTER = b"version https://git-lfs.github.com/spec/"
_WITHOUT_WAITING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""Open flags; a pipe without a writer then opens at once and can be refused."""


def open_regular(path: Path, most_bytes: int | None = None) -> BinaryIO:
    """Open a file for reading.

    Args:
        path: the file, or a link to one.
        most_bytes: largest size, bytes; None for no limit.

    Raises:
        OSError: the file is missing, unreadable, not a regular file, too large, or a Git LFS pointer.
    """
    stream = os.fdopen(os.open(path, os.O_RDONLY | _WITHOUT_WAITING), "rb")
    try:
        found = os.fstat(stream.fileno())
        if not stat.S_ISREG(found.st_mode):
            raise OSError(f"{path} is not a regular file")
        if most_bytes is not None and found.st_size > most_bytes:
            raise OSError(f"{path} has {found.st_size} bytes; {most_bytes} are the limit")
        try:
            start = stream.read(len(LFS_POINTER))
        except OSError as error:  # the error of a read lacks the file name
            raise OSError(error.errno, error.strerror, str(path)) from error
        if start == LFS_POINTER:
            raise OSError(f"{path} is a Git LFS pointer: run `git lfs pull` where it comes from")
        stream.seek(0)
    except BaseException:
        stream.close()
        raise
    return stream


def read_text(path: Path, most_bytes: int = MIB) -> str:
    """Return the UTF-8 text of a regular file, without a byte order mark.

    Raises:
        OSError: as `open_regular`.
        UnicodeDecodeError: the file is not UTF-8.
    """
    with open_regular(path, most_bytes) as stream:
        return stream.read(most_bytes).decode("utf-8-sig")


def read_json(path: Path, most_bytes: int = MIB) -> Any:
    """Return the content of a JSON file; NaN and infinity, which JSON lacks, are refused.

    Raises:
        OSError: as `open_regular`.
        ValueError: invalid JSON or too deep nesting; the message lacks the file name.
    """
    try:
        return json.loads(read_text(path, most_bytes), parse_constant=_refused, parse_float=_finite)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error


def _refused(name: str) -> None:
    raise ValueError(f"{name} is not a number of JSON")


def _finite(text: str) -> float:
    if math.isinf(number := float(text)):
        raise ValueError(f"{text} is too large a number")
    return number


def read_toml(path: Path, most_bytes: int = MIB) -> dict[str, Any]:
    """Return the content of a TOML file.

    Raises:
        OSError: as `open_regular`.
        ValueError: invalid TOML or too deep nesting; the message lacks the file name.
    """
    try:
        return tomllib.loads(read_text(path, most_bytes))
    except RecursionError as error:
        raise ValueError("nested too deeply") from error


def read_npz(path: Path, largest_bytes: int) -> dict[str, NDArray[Any]]:
    """Return the arrays of an `.npz` file by name: numbers and text only, never pickled objects.

    Args:
        path: the file.
        largest_bytes: limit on the unpacked size of all arrays, checked in the archive's index before unpacking.

    Raises:
        FileNotFoundError: missing file.
        ValueError: unreadable, damaged or too large file, or content other than arrays of numbers and text.
    """
    import numpy as np  # noqa: PLC0415 - the command line reads `hands.toml` without it

    try:
        with open_regular(path) as stream, np.load(stream, allow_pickle=False) as archive:
            claimed = sum(member.file_size for member in archive.zip.infolist())
            if claimed > largest_bytes:
                raise ValueError(f"it unpacks to {claimed} bytes; {largest_bytes} are the limit")
            return dict(archive)
    except FileNotFoundError:
        raise
    except Exception as error:  # zipfile, its decompressors and NumPy raise arbitrary exceptions on damaged bytes
        raise ValueError(f"not a readable .npz file: {error or type(error).__name__}") from error
