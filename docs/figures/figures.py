"""The table of docs/figures.md: every table there is."""

from __future__ import annotations

from figures.cells import Tolerance
from figures.sources import Row, Source, sources


def tables() -> list[Row]:
    """Each table with its command, when it is measured, and its tolerance."""
    return [
        ("table", "command", "measured", "tolerance"),
        *(
            (f"[{name}]({name.partition('.')[0]}.md)", source.command, source.cost.value, str(source.tolerance))
            for name, source in sources().items()
            if name != "figures.tables"
        ),
    ]


LISTED = Tolerance("words only")
TABLES = {"tables": Source(tables, "`docs/figures/` has the functions", LISTED, origin="")}
