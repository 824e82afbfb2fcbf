"""Reads `.npz` files that others made: arrays of plain numbers or text, no more bytes than expected, nothing run."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from aero.regular_file import open_regular

HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
SUFFIX = ".npy"


class NpzError(ValueError):
    """A file that holds no arrays, or more than expected; the message says which, the caller names the file."""


def read_npz(path: Path, largest_bytes: int) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file by name.

    Args:
        path: the file.
        largest_bytes: what all arrays together may take. A file says that before it is unpacked, and is taken at its
            word: neither a zip bomb nor an array that claims more than the file has is given memory.

    Raises:
        FileNotFoundError: there is no such file.
        NpzError: the file cannot be read, is damaged, holds anything but arrays of numbers and text, or is too large.
    """
    try:
        with open_regular(path) as stream, zipfile.ZipFile(stream) as archive:
            members = archive.infolist()
            if (claimed := sum(member.file_size for member in members)) > largest_bytes:
                raise NpzError(f"it unpacks to {claimed} bytes; {largest_bytes} are the most that make sense")
            arrays = {}
            for member in members:
                with archive.open(member) as content:
                    arrays[member.filename.removesuffix(SUFFIX)] = _array(content, member.file_size)
    except (FileNotFoundError, NpzError):
        raise
    except Exception as error:  # of damaged bytes, zipfile, its decompressors and NumPy's parser raise all there is
        raise NpzError(f"not a readable .npz file: {error or type(error).__name__}") from error
    return arrays


def _array(content: IO[bytes], size: int) -> NDArray[Any]:
    shape, fortran, dtype = HEADERS[npy.read_magic(content)](content)
    count = math.prod(shape)
    if dtype.hasobject or min(shape, default=0) < 0 or count * dtype.itemsize > size:
        raise NpzError(f"an array of shape {shape} and type {dtype} does not fit its {size} bytes")
    flat = np.frombuffer(content.read(count * dtype.itemsize), dtype, count)
    return flat.reshape(shape, order="F" if fortran else "C").copy()
