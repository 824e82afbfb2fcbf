"""Conversion of TOML tables to frozen dataclasses: checks types, ranges and unknown keys, with a one-line error.

`aero` reads its own files without this module, so that driving a hand needs NumPy and pyserial only.
"""

import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import is_dataclass
from difflib import get_close_matches
from enum import Enum, EnumType
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

T = TypeVar("T")
PLAIN = {
    " | null`": "`",
    "`object`": "a table",
    "`array`": "a list",
    "`str`": "text",
    "Object missing required field": "missing key",
}
"""Type names of msgspec, to those of TOML."""


def parsed(text: str, where: str) -> dict[str, Any]:
    """Return the table of a TOML text; `where` names its file.

    Raises:
        ValueError: no TOML, or too deep nesting.
    """
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{where} is not TOML: {error}") from error


def filled(kind: type[T], table: Any, where: str) -> T:
    """Return the dataclass `kind` with the values of a table.

    Args:
        kind: dataclass; `msgspec.Meta` of a field gives its range.
        table: values by field name.
        where: file and table, for messages.

    Raises:
        ValueError: an unknown or missing key, a wrong type, or a value out of range; the message names the key.
    """
    import msgspec  # noqa: PLC0415 - `aero-hil --help` needs no table

    _check(kind, table, where)
    try:
        return msgspec.convert(table, kind, dec_hook=_built)
    except msgspec.ValidationError as error:
        said, _, key = str(error).partition(" - at `$")
        for word, plain in PLAIN.items():
            said = said.replace(word, plain)
        raise ValueError(f"{where}{key.rstrip('`')}: {said[:1].lower()}{said[1:]}") from error


def _built(kind: type, value: object) -> object:
    """Return a value of a type that TOML lacks: a function as it is, or a path of its text."""
    if callable(value):
        return value
    if not isinstance(value, str):
        raise TypeError(f"expected text, got {value!r}")
    return kind(value)


def meant(name: str, known: Iterable[str]) -> str:
    """Return a question that suggests a similar known name, or "" if none is similar."""
    close = get_close_matches(name, list(known), 1)
    return f"did you mean `{close[0]}`? " if close else ""


def _check(kind: Any, value: Any, where: str) -> None:
    """Refuse unknown keys and infinite numbers, which msgspec accepts in a dataclass, and name the allowed words."""
    rows = value if isinstance(value, list) else [value]
    for inner in filter(is_dataclass, (kind, *get_args(kind))):
        known = get_type_hints(inner)
        for place, row in enumerate(rows):
            at = f"{where}[{place}]" if rows is value else where
            for key, field in row.items() if isinstance(row, Mapping) else ():
                if key not in known:
                    raise ValueError(f"{at}: unknown key `{key}`; {meant(key, known)}known are {', '.join(known)}")
                for option in (known[key], *get_args(known[key])) if isinstance(field, str | int) else ():
                    if (allowed := _allowed(option)) and field not in allowed:
                        raise ValueError(f"{at}.{key} is one of {', '.join(map(str, allowed))}, not {field!r}")
                if isinstance(field, float) and not math.isfinite(field):
                    raise ValueError(f"{at}.{key} must be finite, not {field}")
                _check(known[key], field, f"{at}.{key}")


def _allowed(kind: Any) -> tuple[Any, ...]:
    """Return the values of a Literal or an Enum, () of another type."""
    if get_origin(kind) is Literal:
        return get_args(kind)
    values: Iterable[Enum] = kind if isinstance(kind, EnumType) else ()
    return tuple(one.value for one in values)
