"""Whether the values of a header are what its fields are for; a file may say anything."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from datetime import datetime
from typing import Any, get_args

from model.geometry import Side


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST


def _table(of: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, Mapping) and all(map(_text, value)) and all(map(of, value.values()))


def _date(value: Any) -> bool:
    if not _text(value):
        return False
    try:
        return not value or abs(datetime.fromisoformat(value).timestamp()) < FARTHEST_S
    except (ValueError, OverflowError, OSError):
        return False


LARGEST = 1e15
"""Of any number in a header."""
FARTHEST_S = 2**33
"""From 1970, s: the times of MCAP, ns in 64 bits, reach the year 2554."""
KINDS: dict[str, tuple[Callable[[Any], bool], str]] = {
    **dict.fromkeys(
        ("experiment", "target", "firmware", "map", "window", "unit", "commit", "host", "command", "operator"),
        (_text, "a text"),
    ),
    **dict.fromkeys(("hand_id", "limits", "faults"), (_text, "a text")),
    "hand": (lambda value: value in get_args(Side), "right or left"),
    "seed": (_whole, "a whole number from 0 on"),
    "parameters": (_table(lambda value: _text(value) or _number(value)), "texts and finite numbers by name"),
    "safety": (_table(_number), "finite numbers by name"),
    "versions": (_table(_text), "texts by name"),
    "started": (_date, "a date, ISO 8601"),
    "duration_s": (lambda value: _number(value) and value >= 0.0, "seconds from 0 on"),
    "finished": (lambda value: isinstance(value, bool), "true or false"),
}
"""Field, what it accepts, and what that is."""


def check(header: Mapping[str, Any]) -> None:
    """See that every value of a header has the kind of its field.

    Raises:
        ValueError: one has not, or there is no such field; the message names it.
    """
    for name, value in header.items():
        if name not in KINDS:
            raise ValueError(f"the header has a field {name!r}, which this version does not know")
        accepts, what = KINDS[name]
        if not accepts(value) or (isinstance(value, float) and math.isnan(value)):
            raise ValueError(f"{name} in the header is {str(value)[:80]!r}, not {what}")
