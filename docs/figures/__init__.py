"""The measured figures of README.md and docs/: what was measured lies in `stored/`, and `cog` writes it into the pages.

A page has a marker:

    <!-- [[[cog cog.out(table("validation.staircase")) ]]] -->
    ...
    <!-- [[[end]]] -->
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from aero.whole_file import write_whole

ROOT = Path(__file__).parents[2]
STORED = Path(__file__).parent / "stored"
MEASURED = ("actuation_map", "hand_model", "electronics", "safety", "validation", "campaign", "diagnosis")
"""Modules of this package, each named as its page, whose `TABLES` measure its tables, the quickest first."""
EXCUSED = {
    "calibration.currents": "needs sixteen public recordings, which are not in this repository",
    "calibration.scores": "needs sixteen public recordings, which are not in this repository",
    "calibration.twins": "two minutes of a core for each twin",
    "commands.wear": "twenty validations of each of nineteen hands",
    "driver.faults": "71,500 exchanges for each cell",
    "driver.schedules": "100,000 exchanges for each cell",
    "faults.faults": "over a thousand validations",
    "faults.healthy": "part of the same campaign as faults.faults",
    "grasps.held": "33 grasps on each of 22 hands",
    "lerobot.commands": "needs LeRobot, in real time",
    "safety.busy": "3.3 hours of hand time",
}
"""Tables that `--check` does not measure, each with the reason; their captions name the commit."""
ANOTHER_MUJOCO = 0.06
"""Relative tolerance of a figure that another version of MuJoCo has measured."""
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")

Rows = Sequence[Sequence[str]]
"""The header, then the rows; the first cell of a row names it."""


def functions() -> dict[str, Callable[[], Rows]]:
    """Return the function of each table that is measured here, by PAGE.NAME."""
    return {f"{page}.{one.__name__}": one for page in MEASURED for one in import_module(f"figures.{page}").TABLES}


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


def differences(stored: Rows, measured: Rows, tolerance: float = 0.0) -> Iterator[str]:
    """Yield a line for each row that differs in its words, or in a number by more than one unit of the last place.

    Args:
        stored: rows in the page.
        measured: rows of today.
        tolerance: relative tolerance of numbers besides.
    """
    if len(stored) != len(measured):
        yield f"{len(stored)} rows stored, {len(measured)} measured"
        return
    for old, new in zip(stored, measured, strict=True):
        if not all(_alike(one, other, tolerance) for one, other in zip(old, new, strict=True)):
            yield f"stored {' | '.join(old)}; measured {' | '.join(new)}"


def _alike(old: str, new: str, tolerance: float) -> bool:
    """Return whether two cells have the same words and nearly the same numbers."""
    numbers = zip(_NUMBER.findall(old), _NUMBER.findall(new), strict=False)
    return _NUMBER.sub("#", old) == _NUMBER.sub("#", new) and all(
        math.isclose(float(a), float(b), abs_tol=1.01 * 10.0 ** -len(a.partition(".")[2]), rel_tol=tolerance)
        for a, b in numbers
    )


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
