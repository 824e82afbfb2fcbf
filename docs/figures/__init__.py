"""The measured figures of README.md and docs/: what was measured lies in `stored/`, and `cog` writes it into the pages.

A page has a marker:

    <!-- [[[cog cog.out(table("validation.staircase")) ]]] -->
    ...
    <!-- [[[end]]] -->
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aero.whole_file import write_whole

if TYPE_CHECKING:
    from train.campaign.trial import Outcome

ROOT = Path(__file__).parents[2]
STORED = Path(__file__).parent / "stored"
MEASURED = ("validation", "diagnosis", "hand_model", "actuation_map", "electronics", "safety")
"""Modules of this package, each named as its page, whose functions measure a table in seconds to a minute."""

Rows = Sequence[Sequence[str]]
"""The header, then the rows; the first cell of a row names it."""


def functions() -> dict[str, Callable[[], Rows]]:
    """Return the function of each table that is measured here, by PAGE.NAME."""
    return {f"{page}.{one.__name__}": one for page in MEASURED for one in import_module(f"figures.{page}").TABLES}


def from_campaigns(folders: Sequence[Path]) -> dict[str, Callable[[], Rows]]:
    """Return the function of each table that is computed from stored campaigns, by PAGE.NAME.

    Raises:
        StoreError: a folder has no campaign, or a damaged one; on the first call of a function.
    """
    from figures import campaign  # noqa: PLC0415 - only these tables need the extra `campaign`
    from train.campaign.store import opened  # noqa: PLC0415

    def measured(table: Callable[[Sequence[Outcome]], Rows]) -> Rows:
        outcomes: list[Outcome] = []
        for folder in folders:
            with opened(folder, read_only=True) as campaign_store:
                outcomes += campaign_store.outcomes()
        return table(outcomes)

    return {f"campaign.{one.__name__}": partial(measured, one) for one in campaign.TABLES}


def load(name: str) -> dict[str, Any]:
    """Return a stored result: `command` that shows the figures, `origin` of what made them, `rows`.

    Raises:
        OSError: there is no such result.
    """
    result: dict[str, Any] = json.loads((STORED / f"{name}.json").read_text(encoding="utf-8"))
    return result


def store(name: str, rows: Rows, **changed: str) -> None:
    """Replace the rows of a stored result, and its `command` or `origin` where given."""
    result = load(name) | changed
    lines = ",\n  ".join(json.dumps(list(row), ensure_ascii=False) for row in rows)
    head = "".join(f' "{key}": {json.dumps(result[key], ensure_ascii=False)},\n' for key in ("command", "origin"))
    write_whole(STORED / f"{name}.json", f'{{\n{head} "rows": [\n  {lines}\n ]\n}}\n')


def table(name: str) -> str:
    """Return a stored result as a table in Markdown, with its command and origin below."""
    result = load(name)
    header, *rows = (f"| {' | '.join(row)} |" for row in result["rows"])
    rule = "|---" * len(result["rows"][0]) + "|"
    caption = f"{result['command']}; {result['origin']}." if result["origin"] else f"{result['command']}."
    return "\n".join(("", header, rule, *rows, "", caption, "", ""))


def pages() -> list[Path]:
    """Return the pages that have a table of figures."""
    every = [
        ROOT / "README.md",
        *sorted((ROOT / "docs").glob("*.md")),
        ROOT / "lerobot_robot_aero/lerobot.md",
        ROOT / "examples/grasps/grasps.md",
    ]
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
