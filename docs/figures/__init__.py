"""The measured figures of README.md and docs/: what was measured lies in `stored/`, and `cog` writes it into the pages.

A page has a marker:

    <!-- [[[cog cog.out(table("validation.staircase")) ]]] -->
    ...
    <!-- [[[end]]] -->
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

from figures.inputs import ROOT
from figures.results import Rows, load

_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


def differences(stored: Rows, measured: Rows, tolerance: float = 0.0) -> Iterator[str]:
    """Yield a line for each measured row that is not stored with the same words and nearly the same numbers.

    Args:
        stored: header and rows.
        measured: header, of stored columns, and rows.
        tolerance: relative tolerance of numbers; one unit of the last place is always allowed.
    """
    missing = set(measured[0]) - set(stored[0])
    if missing:
        yield f"no column {', '.join(sorted(missing))} stored"
        return
    at = [list(stored[0]).index(name) for name in measured[0]]
    kept = [[row[place] for place in at] for row in stored[1:]]
    for row in measured[1:]:
        if not any(all(_alike(one, other, tolerance) for one, other in zip(old, row, strict=True)) for old in kept):
            before = next((" | ".join(old) for old in kept if old[0] == row[0]), "no such row")
            yield f"stored {before}; measured {' | '.join(row)}"


def _alike(old: str, new: str, tolerance: float) -> bool:
    """Return whether two cells have the same words and nearly the same numbers."""
    numbers = zip(_NUMBER.findall(old), _NUMBER.findall(new), strict=False)
    return _NUMBER.sub("#", old) == _NUMBER.sub("#", new) and all(
        math.isclose(float(a), float(b), abs_tol=1.01 * 10.0 ** -len(a.partition(".")[2]), rel_tol=tolerance)
        for a, b in numbers
    )


def table(name: str) -> str:
    """Return a stored result as a table in Markdown, with its command below."""
    stored = load(name)
    header, *rows = (f"| {' | '.join(row)} |" for row in stored.rows)
    return "\n".join(("", header, "|---" * len(stored.rows[0]) + "|", *rows, "", f"{stored.command}.", "", ""))


def pages() -> list[Path]:
    """Return the pages that have a table of figures."""
    every = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return [page for page in every if "[[[cog cog.out(table(" in page.read_text(encoding="utf-8")]


def written(page: Path) -> str:
    """Return a page with its tables as they are stored.

    Raises:
        cogapp.CogError: a marker of the page is wrong.
    """
    from cogapp import Cog  # noqa: PLC0415 - a result is stored without it

    cog = Cog()
    cog.options.prologue = "from figures import table"
    text: str = cog.process_string(page.read_text(encoding="utf-8"), fname=page.relative_to(ROOT).as_posix())
    return text
