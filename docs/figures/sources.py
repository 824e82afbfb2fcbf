"""Which tables there are, and a table as text for its page."""

from __future__ import annotations

import enum
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from importlib import import_module

import mujoco

from figures.cells import Cell, Tolerance

PAGES = (
    "figures",
    "validation",
    "hand_model",
    "actuation_map",
    "calibration",
    "driver",
    "electronics",
    "campaign",
    "safety",
    "promises",
    "speed",
    "grasps",
    "training",
    "lerobot",
)
"""Modules of this package that have tables, each named as its page."""
PHYSICS = f"MuJoCo {'.'.join(mujoco.__version__.split('.')[:2])}"

Row = Sequence[Cell | str]


class Cost(enum.Enum):
    """When a table is measured anew."""

    QUICK = "quick"
    """In the default run of the tests: seconds."""
    SLOW = "slow"
    """With `-m slow`: minutes at most."""
    STORED = "stored"
    """Read from a committed result that took longer; the file says how it was made."""


@dataclass(frozen=True)
class Source:
    """Where the figures of one table come from."""

    measure: Callable[[], Sequence[Row]]
    """Gives the header and the rows; the first cell of each row names it."""
    command: str
    """What shows the same figures to a reader."""
    tolerance: Tolerance
    cost: Cost = Cost.QUICK
    origin: str = PHYSICS
    """What it was measured with; for a stored result, where it is and what made it."""

    @property
    def caption(self) -> str:
        """What stands below the table."""
        return f"{self.command}; {self.origin}." if self.origin else f"{self.command}."


def sources() -> dict[str, Source]:
    """Return every table by PAGE.NAME."""
    return {
        f"{page}.{name}": source for page in PAGES for name, source in import_module(f"figures.{page}").TABLES.items()
    }


def table(name: str, previous: str, costs: Collection[Cost] = tuple(Cost)) -> str:
    """Return a table in Markdown, measured anew.

    Args:
        name: PAGE.NAME, a key of `sources`.
        previous: the table as it is printed; figures that moved by less than the tolerance stay as they are.
        costs: what is measured; a table that costs something else stays as it is.

    Raises:
        KeyError: there is no such table.
    """
    source = sources()[name]
    if source.cost not in costs:
        return previous
    header, *rows = source.measure()
    printed, physics = _printed(previous), re.findall(r"; (MuJoCo [\d.]*\d)\.$", previous, re.M)
    same = not physics or physics == [PHYSICS]
    settled = [[_settled(*pair, source.tolerance, same) for pair in _beside(row, printed)] for row in rows]
    text = _text(header, settled, source.caption)
    if same:
        return text
    stands = text.replace(PHYSICS, physics[0]) == previous
    return previous if stands else _text(header, rows, source.caption)


def _text(header: Row, rows: Sequence[Row], caption: str) -> str:
    lines = [f"| {' | '.join(map(_words, row))} |" for row in (header, *rows)]
    return "\n".join(("", lines[0], "|---" * len(header) + "|", *lines[1:], "", caption, "", ""))


def _words(cell: Cell | str) -> str:
    return cell.text if isinstance(cell, Cell) else cell


def _printed(previous: str) -> dict[str, list[str]]:
    """Return the cells of each printed row by the first of them."""
    rows = [[cell.strip() for cell in line[1:-1].split(" | ")] for line in previous.splitlines() if line[:1] == "|"]
    return {row[0]: row for row in rows}


def _beside(row: Row, printed: dict[str, list[str]]) -> list[tuple[Cell | str, str]]:
    """Return each cell of a row with what is printed in its place, empty when nothing is."""
    old = printed.get(_words(row[0]), [])
    return list(zip(row, old if len(old) == len(row) else [""] * len(row), strict=True))


def _settled(cell: Cell | str, printed: str, tolerance: Tolerance, same: bool) -> str:
    stands = isinstance(cell, Cell) and cell.stands(printed, tolerance, same_physics=same)
    return printed if stands else _words(cell)
