"""Tables of docs/promises.md."""

from __future__ import annotations

import json
from pathlib import Path

from figures.cells import Cell, Tolerance
from figures.sources import Cost, Row, Source
from hil.verdict.promises import PROMISES

FOUND = Path(__file__).parents[2] / "tests" / "safety" / "nearest_promises.json"
"""What the last search wrote."""
EXACT = Tolerance("the table and the stored result say the same")


def promises() -> list[Row]:
    """Every promise: its words and its formula."""
    header = ("promise", "in words", "formula", "judged")
    return [
        header,
        *(
            (f"`{one.name}`", one.words, f"`{one.formula}`", "recordings, search" if one.recorded else "search")
            for one in PROMISES
        ),
    ]


def margins() -> list[Row]:
    """The smallest margin that the search has found of each promise."""
    smallest = json.loads(FOUND.read_text(encoding="utf-8"))["smallest"]
    return [
        ("promise", "smallest margin found", "unit"),
        *((f"`{one.name}`", Cell.of("{:.3g}", smallest[one.name]), one.unit) for one in PROMISES),
    ]


def searched() -> str:
    """Say how long, over what and with which seeds was searched."""
    found = json.loads(FOUND.read_text(encoding="utf-8"))
    first, last = found["seeds"]
    hours = f"{found['hours']:g} h, {found['programs']} programs, seeds {first} to {last}"
    return f"tests/safety/nearest_promises.json, {hours}"


SEARCH = "`PROMISE_SEARCH_S=SECONDS pytest -s -m slow tests/safety/test_promises.py -k search`"
TABLES = {
    "promises": Source(promises, "`hil/verdict/promises.py`", EXACT, origin=""),
    "margins": Source(margins, SEARCH, EXACT, Cost.STORED, searched()),
}
