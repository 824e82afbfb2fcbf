"""Committed results of measurements that take hours: tables are made from them, and not measured anew."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from figures.cells import Tolerance
from figures.sources import Cost, Row, Source

STORED = Tolerance("made from the committed result")


@dataclass(frozen=True)
class Result:
    """One file of `docs/figures/stored`."""

    command: str
    """What makes the figures."""
    seeds: str
    commit: str
    """Of the code that was measured."""
    generator: str
    """What draws the hands, cubes or mutants that were measured."""
    rows: tuple[dict[str, Any], ...]

    @property
    def origin(self) -> str:
        """Where the figures come from, for the caption."""
        return f"seeds {self.seeds}; {self.generator}; commit {self.commit}"


def folder() -> Path:
    """Return where the results lie."""
    return Path(__file__).parent / "stored"


def load(name: str) -> Result:
    """Return a stored result.

    Raises:
        OSError: there is no such result.
        KeyError, TypeError: its origin is not complete.
    """
    table = json.loads((folder() / f"{name}.json").read_text(encoding="utf-8"))
    return Result(**table["provenance"], rows=tuple(table["rows"]))


def stored(name: str, measure: Callable[[Result], list[Row]]) -> Source:
    """Return the source of a table that is made from a stored result."""
    result = load(name)
    origin = f"{result.origin}; kept in `docs/figures/stored/{name}.json`"
    return Source(lambda: measure(load(name)), f"`{result.command}`", STORED, Cost.STORED, origin)


def plain(result: Result) -> list[Row]:
    """Return rows as they are kept: each maps the columns to what was measured."""
    header = tuple(dict.fromkeys(column for row in result.rows for column in row))
    return [header, *(tuple(str(row.get(column, "")) for column in header) for row in result.rows)]
