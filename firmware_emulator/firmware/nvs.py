"""Non-volatile storage (NVS) of the ESP32: seven extend values, in a file or in memory."""

import json
import os
from pathlib import Path
from tempfile import TemporaryFile

LARGEST_BYTES = 2**20
"""Size limit of a state file; real ones have about a hundred bytes."""


class Nvs:
    """Integers of namespace `hand`, keys `ext0` to `ext6`; each write reaches the file at once."""

    def __init__(self, path: Path | None = None) -> None:
        """Open the storage, in memory or backed by the JSON file at `path`.

        Raises:
            ValueError: the file is not a JSON object of integers, or its folder is missing or not writable.
        """
        self._path = path
        self._values: dict[str, int] = _stored(path) if path is not None else {}

    def extend(self, channel: int, baseline: int) -> int:
        """Return a channel's stored extend value (counts), or the baseline if none in 0..4095 is stored."""
        value = self._values.get(f"ext{channel}", -1)
        return value if 0 <= value <= 4095 else baseline

    def store_extend(self, channel: int, value: int) -> None:
        """Store a channel's extend value (counts)."""
        self.store(f"ext{channel}", value)

    def items(self) -> list[tuple[str, int]]:
        """Return all stored keys and numbers; keys of other namespaces have the form `namespace/key`."""
        return sorted(self._values.items())

    def store(self, key: str, value: int) -> None:
        """Store a number."""
        self._values[key] = value
        self._write()

    def forget(self, key: str) -> None:
        """Delete a key, if present."""
        self._values.pop(key, None)
        self._write()

    def _write(self) -> None:
        if self._path is not None:
            # Written to a draft and renamed, so that a crash never truncates the file.
            draft = self._path.with_name(f".{self._path.name}.{os.getpid()}")
            draft.unlink(missing_ok=True)
            with draft.open("x", encoding="utf-8") as stream:  # mode "x" does not follow a symbolic link
                stream.write(json.dumps(self._values, indent=1, sort_keys=True) + "\n")
            draft.replace(self._path)


def _stored(path: Path) -> dict[str, int]:
    """Return the content of a state file, or an empty dictionary if it does not exist yet."""
    if path.name and not (path.is_symlink() or path.exists()):
        try:
            with TemporaryFile(dir=path.parent):
                return {}
        except OSError as error:
            raise ValueError(f"the state of an emulated hand cannot be stored in {path}: {error}") from error
    if not path.is_file():
        raise ValueError(f"{path} is not the state of an emulated hand: not a regular file")
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise ValueError(f"larger than {LARGEST_BYTES} bytes")
        values = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ValueError(f"{path} is not the state of an emulated hand: {error}; delete it to start afresh") from error
    if not isinstance(values, dict) or not all(type(value) is int for value in values.values()):
        raise ValueError(f"{path} must hold an object of integers such as {{'ext0': 2048}}; delete it to start afresh")
    return values
