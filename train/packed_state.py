"""The state of a run in a file small enough to hand on: `python -m train.packed_state pack|unpack FOLDER FILE`.

Nothing is lost. The bytes of the numbers are stored plane by plane, all first bytes, then all second ones, since signs
and exponents compress alone and mantissas do not.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import click
import numpy as np

from train.run_state import STATE


def pack(folder: Path, path: Path) -> None:
    """Write the state of the run in `folder` to `path`, LZMA in a zip file."""
    with (
        np.load(folder / STATE, allow_pickle=False) as archive,
        zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as packed,
    ):
        for name in archive.files:
            array = archive[name]
            header = io.BytesIO()
            np.lib.format.write_array_header_2_0(header, np.lib.format.header_data_from_array_1_0(array))
            planes = np.frombuffer(array.tobytes(), np.uint8).reshape(array.size, array.itemsize).T
            packed.writestr(name, header.getvalue() + planes.tobytes())


def unpack(folder: Path, path: Path) -> None:
    """Write the state that `pack` wrote into `folder`, which is made if missing.

    Raises:
        FileExistsError: the folder holds a run.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if (folder / STATE).exists():
        raise FileExistsError(f"{folder} holds a run")
    arrays = {}
    with zipfile.ZipFile(path) as packed:
        for name in packed.namelist():
            stream = io.BytesIO(packed.read(name))
            np.lib.format.read_magic(stream)
            shape, _, kind = np.lib.format.read_array_header_2_0(stream)
            planes = np.frombuffer(stream.read(), np.uint8).reshape(kind.itemsize, -1)
            arrays[name] = np.frombuffer(planes.T.tobytes(), kind).reshape(shape)
    np.savez(folder / STATE, allow_pickle=False, **arrays)


@click.command()
@click.argument("what", type=click.Choice(["pack", "unpack"]))
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path))
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path))
def main(what: str, folder: Path, file: Path) -> None:
    """Hand on the state of the run in FOLDER as FILE, or take it from there."""
    {"pack": pack, "unpack": unpack}[what](folder, file)


if __name__ == "__main__":
    main()
