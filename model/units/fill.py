"""Fill a dataclass from a table of a TOML file, refusing everything that does not fit."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, TypeVar

T = TypeVar("T")


def fill(kind: type[T], table: Mapping[str, Any], where: str) -> T:
    """Return `kind()` with the values of `table` in place of its defaults.

    A value must have the type of the default it replaces: a number for a number, true or false for a switch, a list
    of the same length for a tuple, a table for a dataclass.

    Args:
        kind: a dataclass whose fields all have defaults.
        table: values by field name.
        where: name of the table, for messages.

    Raises:
        ValueError: an unknown key, a value of the wrong kind, or one that is not finite; the message names it.
    """
    defaults: Any = kind()
    names = [field.name for field in dataclasses.fields(defaults)]
    if unknown := sorted(table.keys() - set(names)):
        raise ValueError(f"{where}: unknown {', '.join(unknown)}; known are {', '.join(names)}")
    values = {name: _value(getattr(defaults, name), value, f"{where}.{name}") for name, value in table.items()}
    filled: T = dataclasses.replace(defaults, **values)
    return filled


def _value(default: Any, value: Any, where: str) -> Any:
    if dataclasses.is_dataclass(default) and isinstance(value, Mapping):
        return fill(type(default), value, where)
    if isinstance(default, tuple) and isinstance(value, list):
        if len(value) != len(default):
            raise ValueError(f"{where}: needs {len(default)} values, has {len(value)}")
        return tuple(_value(d, v, f"{where}[{i}]") for i, (d, v) in enumerate(zip(default, value, strict=True)))
    if isinstance(default, bool) and isinstance(value, bool):
        return value
    if isinstance(default, str) and isinstance(value, str):
        return value
    if _is_number(default) and _is_number(value):
        if not math.isfinite(value):
            raise ValueError(f"{where}: must be finite, is {value}")
        if isinstance(default, int) and not isinstance(value, int):
            raise ValueError(f"{where}: must be a whole number, is {value}")
        return type(default)(value)
    raise ValueError(f"{where}: a value like {default!r} is expected, not {value!r}")


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
