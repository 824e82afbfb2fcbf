"""Hold every grasp on every hand that is named, and say which ones hold: `python -m examples.grasps`."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

import click

from hil.lab.workers import leave_interrupts_to_the_parent
from model.units.naming import unit_named

from .taxonomy import GRASPS
from .trial import Result, hold

REPORTED_SEEDS = range(91000, 91020)
"""Of the random hands that stand in docs/grasps.md; no posture was tuned on them."""


@click.command()
@click.option("--unit", "units", multiple=True, help="A hand, several if wanted; left out: ideal and reference.")
@click.option("--random", "seeds", is_flag=True, help="Also the 20 random hands, plausible:91000 to 91019.")
@click.option("--grasp", "numbers", multiple=True, type=click.IntRange(1, 33), help="Only this one; several if wanted.")
@click.option("--picture", type=click.Path(path_type=Path), help="Write a JPEG of all grasps on the first hand.")
@click.option("--json", "as_json", is_flag=True, help="Print every single result as JSON.")
@click.option("--workers", default=1, show_default=True, type=click.IntRange(1), help="Processes that share the work.")
def main(
    units: Sequence[str], *, seeds: bool, numbers: Sequence[int], picture: Path | None, as_json: bool, workers: int
) -> None:
    """Make the 33 grasps of the GRASP taxonomy on emulated hands and say which hold."""
    names = [*(units or ("ideal", "reference")), *(f"plausible:{seed}" for seed in REPORTED_SEEDS if seeds)]
    grasps = [grasp for grasp in GRASPS if not numbers or grasp.number in numbers]
    results: dict[str, list[Result]] = {}
    with ProcessPoolExecutor(workers, initializer=leave_interrupts_to_the_parent) as pool:
        trials = pool.map(hold, *zip(*product(grasps, map(unit_named, names)), strict=True))
        for grasp in grasps:
            results[grasp.name] = [next(trials) for _ in names]
            held = sum(result.held for result in results[grasp.name])
            print(f"{grasp.number} {grasp.name}: {held} of {len(names)} hold", file=sys.stderr, flush=True)
    if as_json:
        print(json.dumps([dataclasses.asdict(result) for row in results.values() for result in row], indent=1))
    else:
        print(table(names, results))
    if picture is not None:
        from .picture import write_contact_sheet  # noqa: PLC0415  pictures alone need OpenGL

        write_contact_sheet(grasps, [row[0] for row in results.values()], picture)


def table(names: Sequence[str], results: dict[str, list[Result]]) -> str:
    """Return a Markdown table: a row a grasp, a column for each named hand and one for all random ones."""
    single = [name for name in names if not name.startswith("plausible:")]
    many = len(names) - len(single)
    head = ["", "grasp", *single, *([f"of {many} random"] if many else []), "most frequent failure"]
    rows = [head, ["---"] * len(head)]
    for name, row in results.items():
        chosen = [("yes" if result.held else "no") for result in row[: len(single)]]
        count = [str(sum(result.held for result in row[len(single) :]))] if many else []
        failures = Counter(result.failure for result in row if not result.held).most_common(1)
        why = f"{failures[0][0]} ({failures[0][1]})" if failures else ""
        rows.append([str(row[0].grasp), name, *chosen, *count, why])
    columns = list(zip(*results.values(), strict=True))
    sums = [sum(result.held for result in column) for column in columns]
    random = [f"{min(sums[len(single) :])} to {max(sums[len(single) :])} a hand"] if many else []
    rows.append(["", f"held, of {len(results)}", *map(str, sums[: len(single)]), *random, ""])
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


if __name__ == "__main__":
    main()
