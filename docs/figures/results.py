"""One JSON file for each made thing: a table of a page, or files that ship; with its sample and its inputs."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from aero.whole_file import write_whole
from figures.inputs import Inputs, changed

STORED = Path(__file__).parent / "stored"

Rows = Sequence[Sequence[str]]
"""The header, then the rows; the first cell of a row names it."""


class Shipped(NamedTuple):
    """Files that ship and are made by a command."""

    files: tuple[str, ...]
    maker: tuple[str, ...]
    """Modules of the command, besides the module of the sample."""
    sample: Callable[[], Rows]
    """Remakes a part of them in less than a minute, or all."""
    make: Callable[[], object] | None = None
    """Writes the files; None for a table, and for files that a person has to make."""
    shipped: Callable[[], Rows] | None = None
    """Reads from the files what the sample should equal; None if only a stored sample says it."""


@dataclass(frozen=True)
class Stored:
    """What is known of a made thing."""

    command: str = ""
    """Command that shows the figures of a table, as its page names it."""
    rows: Rows = ()
    """Table of a page; empty for files that ship."""
    sample: Rows = ()
    """Small part of the making, remade to see whether it is up to date; empty if the table holds it."""
    mujoco: str = ""
    """Version of MuJoCo, major and minor, at the last whole making."""
    differs: str = ""
    """Difference of the sample from the stored one when it was last remade; empty if it was equal."""
    outputs: Inputs = field(default_factory=dict)
    """Files that ship, with the digest of each."""
    inputs: Inputs = field(default_factory=dict)
    """Files that it was made or last sampled from, with the digest of each."""

    @property
    def stale(self) -> list[str]:
        """Files whose meaning has changed since the last sample; outputs of what is known to differ do not count."""
        return changed(self.inputs) + ([] if self.differs else changed(self.outputs))


def names() -> list[str]:
    """Return the names of what is stored."""
    return sorted(path.stem for path in STORED.glob("*.json"))


def load(name: str) -> Stored:
    """Return what is stored.

    Raises:
        OSError: there is no such result.
    """
    text = json.loads((STORED / f"{name}.json").read_text(encoding="utf-8"))
    for key in ("inputs", "outputs"):
        text[key] = {
            f"{folder}/{file}" if folder else file: digest
            for folder, line in text.get(key, {}).items()
            for file, digest in (word.split(":") for word in line.split())
        }
    return Stored(**text)


def store(name: str, stored: Stored) -> None:
    """Write what is known, a line for each row of a table and for the inputs of each folder."""
    lines = []
    for key, value in vars(stored).items():
        if not value:
            continue
        if key in ("rows", "sample"):
            text = "[\n  " + ",\n  ".join(_json(list(row)) for row in value) + "\n ]"
        elif key in ("inputs", "outputs"):
            text = "{\n  " + ",\n  ".join(f"{_json(k)}: {_json(v)}" for k, v in _by_folder(value).items()) + "\n }"
        else:
            text = _json(value)
        lines.append(f' "{key}": {text}')
    write_whole(STORED / f"{name}.json", "{\n" + ",\n".join(lines) + "\n}\n")


def _by_folder(inputs: Inputs) -> dict[str, str]:
    """Return the digests of a folder's files as one line, by folder."""
    parts = sorted((*path.rpartition("/")[::2], digest) for path, digest in inputs.items())
    grouped = groupby(parts, key=lambda part: part[0])
    return {folder: " ".join(f"{name}:{digest}" for _, name, digest in files) for folder, files in grouped}


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
