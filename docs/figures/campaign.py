"""Tables of docs/campaign.md, from campaigns that took hours."""

from __future__ import annotations

from figures.cells import Cell
from figures.sources import Row
from figures.stored import Result, plain, stored
from hil.lab.campaign.summary import Share


def alarms(result: Result) -> list[Row]:
    """Healthy hands, seen by no limit, that the limits accuse."""
    header = ("limits from", "judged by seeds", "healthy hands accused", "share, 95 %")
    rows = []
    for row in result.rows:
        share = Share(row["accused"], row["of"])
        low, high = (100.0 * bound for bound in share.interval)
        interval = Cell.of("{:.1f} % to {:.1f} %", low, high)
        rows.append((f"{row['limits_from']} hands", result.seeds, f"{share.count} of {share.of}", interval))
    return [header, *rows]


def causes(result: Result) -> list[Row]:
    """How good place and cause are, on hands and kinds of fault that nothing was learned from."""
    header = (
        "faults",
        "found",
        "where is right",
        "first cause right",
        "in the first three",
        "right one in the shown set",
        "shown set empty",
        "causes shown",
    )
    names = ("where", "first", "three", "shown", "empty", "size")
    return [
        header,
        *((row["faults"], f"{row['found']} of {row['of']}", *(row[n] for n in names)) for row in result.rows),
    ]


TABLES = {
    "alarms": stored("alarms", alarms),
    "conditions": stored("conditions", plain),
    "causes": stored("judged_causes", causes),
}
