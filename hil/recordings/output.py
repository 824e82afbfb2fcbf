"""Output folders and files, created and write-tested before a run so that no result is lost."""

import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from hil.recordings.errors import UnwritablePlaceError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]


def json_text(content: Any) -> str:
    """Return tables as JSON; NaN (not measured) and infinity become null."""
    return json.dumps(_jsonable(content), indent=1, allow_nan=False) + "\n"


def _jsonable(content: Any) -> Any:
    if isinstance(content, Mapping):
        return {name: _jsonable(value) for name, value in content.items()}
    if isinstance(content, list | tuple):
        return [_jsonable(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


LATEST = "latest"
"""Name of the link to the newest time-stamped folder."""


def prepared_folder(folder: Path) -> Path:
    """Create a folder and test that it is writable.

    Raises:
        UnwritablePlaceError: the folder cannot be created or written; the message names it.
    """
    missing = next((parent for parent in (*reversed(folder.parents), folder) if not parent.exists()), None)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=folder) as probe:
            probe.write(b"\0" * 4096)
    except OSError as error:
        if missing is not None:
            _remove_empty(folder, missing)
        raise UnwritablePlaceError(
            error.errno, f"cannot write into the folder: {error.strerror}", str(folder)
        ) from error
    return folder


def _remove_empty(folder: Path, first: Path) -> None:
    """Remove a new folder that proved unwritable, and its new parents up to `first`."""
    with suppress(OSError):
        for made in (folder, *folder.parents):
            made.rmdir()
            if made == first:
                return


@contextmanager
def claimed(folder: Path | None) -> Iterator[None]:
    """Lock a folder against other runs during the block.

    Raises:
        UnwritablePlaceError: another run has locked the folder.
    """
    if folder is None or fcntl is None:
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            # flock instead of a lock file, because the system releases it when a program is killed.
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise UnwritablePlaceError(
                error.errno, "another run writes there; name another folder", str(folder)
            ) from error
        except OSError:
            pass  # a file system without locks
        yield
    finally:
        os.close(handle)


@contextmanager
def emptied(folder: Path | None) -> Iterator[None]:
    """Remove a folder at the end of the block if it is empty."""
    try:
        yield
    finally:
        if folder is not None and not any(folder.iterdir()):
            folder.rmdir()


def prepared_file(path: Path) -> Path:
    """Create the folder of a file and test that it is writable; an existing file stays.

    Raises:
        OSError: `path` cannot be written, or is a folder, a device or a dangling link.
    """
    if path.is_dir() or not path.name:
        raise IsADirectoryError(f"{str(path)!r} is a folder; name a file")
    try:
        prepared_folder(path.parent)
    except OSError as error:
        raise UnwritablePlaceError(error.errno, error.strerror, str(path)) from error
    if (path.is_symlink() or path.exists()) and not path.is_file():
        raise OSError(f"{path} exists and is not a regular file; choose another name")
    if path.exists() and not os.access(path, os.W_OK):
        raise PermissionError(f"{path} cannot be written")
    return path


def _made(base: Path, names: Iterator[str]) -> Path:
    """Create a folder with the first free name; atomic, so concurrent programs get different ones."""
    for name in names:
        with suppress(FileExistsError):
            (base / name).mkdir()
            return base / name
    raise FileExistsError(f"{base} holds a thousand results of this second")


def run_folder(base: Path) -> Path:
    """Create a time-stamped folder below `base`, and point the link `latest` there.

    Raises:
        OSError: the folder cannot be created or written.
    """
    stamp = datetime.now().astimezone().strftime("%Y-%m-%dT%H-%M-%S")
    prepared_folder(base)
    folder = prepared_folder(_made(base, (stamp + (f"-{i}" if i else "") for i in range(1000))))
    link = base / LATEST
    if link.is_symlink() or not link.exists():
        fresh = base / f".{LATEST}-{os.getpid()}"
        try:
            fresh.symlink_to(folder.name, target_is_directory=True)
            fresh.replace(link)
        except OSError:
            fresh.unlink(missing_ok=True)  # a file system without links; names sort by time anyway
    return folder
