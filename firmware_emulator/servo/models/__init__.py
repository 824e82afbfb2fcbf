"""Bus servo models, one TOML file each; `model_file` describes the format.

Every number names its source by a letter of its file's `[sources]`; numbers without a source are marked as unknown.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from firmware_emulator.servo.model_file import ServoModel, build_model, read_model

FOLDER = Path(__file__).parent
SHIPPED = tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


@cache
def model_of(name: str) -> ServoModel:
    """Return the model of a shipped name, or of the path of a `.toml` file.

    Raises:
        ValueError: the model is unknown, or the file is invalid.
        OSError: the file cannot be read.
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
REGISTERS = HLS3606M.registers
"""Registers of the HLS3606M by name: EEPROM below 40, RAM 40 to 55, measurements and factory data from 56."""
