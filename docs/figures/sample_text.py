"""Numbers of a sample as text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from figures.results import Rows


def rows_of(table: Mapping[str, Any]) -> Rows:
    """Return a row for each entry of a table, with its numbers in order."""
    return [("name", "numbers"), *([name, numbers(_flat(value))] for name, value in table.items())]


def _flat(value: Any) -> list[float]:
    plain = list(value.values()) if isinstance(value, Mapping) else value
    found: list[float] = np.array(plain, float).ravel().tolist()
    return found


def numbers(values: Iterable[float], digits: int = 5) -> str:
    """Return numbers with so many decimals."""
    return " ".join(f"{float(value):.{digits}f}" for value in values)
