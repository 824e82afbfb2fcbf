"""Tables of docs/grasps.md, from runs of all grasps through the bytes."""

from __future__ import annotations

from grasps.taxonomy import GRASPS

from figures.sources import Row
from figures.stored import Result, stored

RANDOM = 20
"""Hands that were drawn."""


def held(result: Result) -> list[Row]:
    """Each grasp: on which hands it holds, and what most often takes the object."""
    *rows, total = result.rows
    names = {grasp.number: grasp.name for grasp in GRASPS}
    header = ("", "grasp", "ideal", "reference", f"of {RANDOM} random", "most frequent failure", "gives way first")
    sums = [sum(row[hand] for row in rows) for hand in ("ideal", "reference")]
    return [
        header,
        *(
            (
                str(row["grasp"]),
                names[row["grasp"]],
                *("yes" if row[hand] else "no" for hand in ("ideal", "reference")),
                str(row["random"]),
                f"{row['failure']} ({row['failures']})" if row["failure"] else "",
                row["gave_way"],
            )
            for row in rows
        ),
        ("", f"held, of {len(rows)}", *map(str, sums), f"{total['fewest']} to {total['most']} a hand", "", ""),
    ]


def skins(result: Result) -> list[Row]:
    """How many grasps hold with each skin, and which do not."""
    header = ("skin", "hand", f"held, of {len(GRASPS)}", "not held")
    return [
        header,
        *((row["skin"], row["hand"], str(row["held"]), ", ".join(map(str, row["lost"]))) for row in result.rows),
    ]


TABLES = {"held": stored("grasps", held), "skins": stored("grasp_skins", skins)}
