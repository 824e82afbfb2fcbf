"""Reads `.npz` files that others made: arrays of plain numbers or text, no more bytes than expected, nothing run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aero.regular_file import open_regular


def read_npz(path: Path, largest_bytes: int) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file by name.

    Args:
        path: the file.
        largest_bytes: what all arrays together may take; a file says that before it is unpacked.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: the file cannot be read, is damaged, holds anything but arrays of numbers and text, or is too large.
    """
    try:
        with open_regular(path) as stream, np.load(stream, allow_pickle=False) as archive:
            claimed = sum(member.file_size for member in archive.zip.infolist())
            if claimed > largest_bytes:
                raise ValueError(f"it unpacks to {claimed} bytes; {largest_bytes} are the most that make sense")
            return dict(archive)
    except FileNotFoundError:
        raise
    except Exception as error:  # of damaged bytes, zipfile, its decompressors and NumPy's parser raise all there is
        raise ValueError(f"not a readable .npz file: {error or type(error).__name__}") from error
