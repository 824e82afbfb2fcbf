"""Kinds of bus servo, a TOML file each; see `model_file` for what a file states.

Every number names its source by a letter of its file's `[sources]`; what no source states is marked there as unknown.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from firmware_emulator.servo.model_file import ServoModel, build_model, read_model

FOLDER = Path(__file__).parent
SHIPPED = tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))
"""Names of the models that come with this package."""


@cache
def model_of(name: str) -> ServoModel:
    """Return the model of a shipped name, or of the path of a `.toml` file.

    Raises:
        ValueError: no such model, or a file that states none.
        OSError: a file that cannot be read.
    """
    path = _path(name)
    return build_model(read_model(path, _content), path)


def _content(name: str) -> Mapping[str, Any]:
    return read_model(_path(name), _content)


def _path(name: str) -> Path:
    if name in SHIPPED:
        return FOLDER / f"{name}.toml"
    if name.endswith(".toml"):
        return Path(name)
    raise ValueError(f"unknown servo model {name!r}; known are {', '.join(SHIPPED)}, or the path of a .toml file")


HLS3606M = model_of("HLS3606M")
"""The hand's servo."""
REGISTERS = HLS3606M.registers
"""Its registers by name: below 40 EEPROM, 40 to 55 RAM, 56 and above measurements and factory data."""
