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


def diagnosis(result: Result) -> list[Row]:
    """How good the named cause is, on hands that the dictionary has not seen."""
    header = ("batch", "faults above the stated severity that were found", "right cause first", "among the first three")
    return [
        header,
        *(
            (
                ", ".join(str(part) for part in (row["batch"], row["note"]) if part),
                Cell.of(f"{row['found']} of {row['above']} ({{:.1f}} %)", 100.0 * row["found"] / row["above"]),
                f"{row['first_percent']} % of {row['named']}",
                f"{row['among_three_percent']} %",
            )
            for row in result.rows
        ),
    ]


def unknown(result: Result) -> list[Row]:
    """The same on faults that the dictionary does not know."""
    return [
        ("unknown faults", "found", "right cause first", "among the first three"),
        *(
            (
                row["faults"],
                f"{row['found']} of {row['of']}",
                f"{row['first_percent']} % of {row['found']}",
                f"{row['among_three_percent']} %",
            )
            for row in result.rows
        ),
    ]


TABLES = {
    "alarms": stored("alarms", alarms),
    "conditions": stored("conditions", plain),
    "diagnosis": stored("diagnosis", diagnosis),
    "unknown": stored("unknown_faults", unknown),
}
