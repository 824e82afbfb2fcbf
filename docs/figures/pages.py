"""Pages with their tables measured anew, by `cog`."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from difflib import SequenceMatcher
from pathlib import Path

from cogapp import Cog

from figures.sources import Cost

ROOT = Path(__file__).parents[2]
MARKER = "[[[cog cog.out(table("


def pages() -> list[Path]:
    """Return the pages that have a table of figures."""
    every = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    return [page for page in every if MARKER in page.read_text(encoding="utf-8")]


def measured(page: Path, costs: Collection[Cost]) -> str:
    """Return a page with its tables of some costs measured anew; nothing is written.

    Raises:
        cogapp.CogError: a marker of the page is wrong, or a measurement failed.
    """
    cog = Cog()
    names = ", ".join(f"Cost.{cost.name}" for cost in costs)
    cog.options.prologue = (
        "from functools import partial; import figures; from figures.sources import Cost; "
        f"table = partial(figures.table, costs=({names},))"
    )
    text: str = cog.process_string(page.read_text(encoding="utf-8"), fname=page.relative_to(ROOT).as_posix())
    return text


def moved(page: Path, now: str) -> Iterator[str]:
    """Give a message for each line of a page that is no longer what is measured, with its number."""
    name = page.relative_to(ROOT).as_posix()
    before, after = page.read_text(encoding="utf-8").splitlines(), now.splitlines()
    for kind, start, end, new_start, new_end in SequenceMatcher(a=before, b=after, autojunk=False).get_opcodes():
        if kind == "equal":
            continue
        for i in range(max(end - start, new_end - new_start)):
            printed = before[start + i] if start + i < end else "nothing"
            wanted = after[new_start + i] if new_start + i < new_end else "nothing"
            yield f"{name}:{start + i + 1}:\n  printed  {printed}\n  measured {wanted}"
