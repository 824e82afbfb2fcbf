"""Hold every grasp on every hand that is named, and say which ones hold: `python -m examples.grasps`.

With `--hil`, make a grasp with a hand of one's own.
"""

import dataclasses
import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from itertools import product
from pathlib import Path

import click

from aero.safety import SafetyStopError
from hil.emulated.any_hand import open_target
from hil.targets.hand_errors import NoHandError
from model.units.plausible import unit_named
from train.workers import leave_interrupts_to_the_parent

from .grasp import Grasp
from .own_hand import make_grasp
from .skin import Skin
from .taxonomy import GRASPS
from .trial import Result, codes_of, hold

REPORTED_SEEDS = range(92000, 92020)
"""Of the random hands that stand in examples/grasps/grasps.md; no posture was tuned on them."""
PLACING_S = 10.0
"""Time for holding the object out to a hand of one's own, s."""


@click.command()
@click.option("--unit", "units", multiple=True, help="A hand, several if wanted; left out: ideal and reference.")
@click.option(
    "--random", "seeds", is_flag=True,
    help=f"Also the 20 random hands, plausible:{REPORTED_SEEDS[0]} to {REPORTED_SEEDS[-1]}.",
)  # fmt: skip
@click.option("--grasp", "numbers", multiple=True, type=click.IntRange(1, 33), help="Only this one; several if wanted.")
@click.option(
    "--skin", type=click.Choice([*Skin]), default=Skin.SILICONE, show_default=True, help="Surface of the hands."
)
@click.option("--picture", type=click.Path(path_type=Path), help="Write a JPEG of all grasps on the first hand.")
@click.option("--json", "as_json", is_flag=True, help="Print every single result as JSON.")
@click.option("--workers", default=1, show_default=True, type=click.IntRange(1), help="Processes that share the work.")
@click.option(
    "--hil", "port", metavar="TARGET",
    help="Make the one --grasp with the hand at this port, or `emulated`, guarded: 10 s to place the object.",
)  # fmt: skip
@click.option("--seconds", default=10.0, show_default=True, type=click.FloatRange(0.0), help="How long --hil holds.")
def main(
    units: Sequence[str],
    *,
    seeds: bool,
    numbers: Sequence[int],
    skin: Skin,
    picture: Path | None,
    as_json: bool,
    workers: int,
    port: str | None,
    seconds: float,
) -> None:
    """Make the 33 grasps of the GRASP taxonomy on emulated hands and say which hold."""
    if port is not None:
        if len(numbers) != 1:
            raise click.UsageError("--hil makes one grasp: name it with --grasp")
        make_with(port, GRASPS[numbers[0] - 1], seconds)
        return
    names = [*(units or ("ideal", "reference")), *(f"plausible:{seed}" for seed in REPORTED_SEEDS if seeds)]
    hands = [unit_named(name) for name in names]
    grasps = [grasp for grasp in GRASPS if not numbers or grasp.number in numbers]
    results: dict[str, list[Result]] = {}
    with ProcessPoolExecutor(workers, initializer=leave_interrupts_to_the_parent) as pool:
        trials = pool.map(partial(hold, skin=Skin(skin)), *zip(*product(grasps, hands), strict=True))
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


def make_with(port: str, grasp: Grasp, seconds: float) -> None:
    """Make a grasp with the hand at `port`, and say where the encoders ended."""
    with ended_well(), open_target(port, guarded=True) as target:
        thing = grasp.thing
        print(
            f"{grasp.name}: hold out a {thing.shape}, {thing.size_mm} mm, centre {grasp.centre_mm} mm: {PLACING_S:g} s"
        )
        held = make_grasp(target, grasp, PLACING_S, seconds)
        print(f"held with codes {held.tolist()}, sent {codes_of(grasp.closure, target.map).tolist()}")


@contextmanager
def ended_well() -> Iterator[None]:
    """Give what a hand refuses as a message."""
    try:
        yield
    except (NoHandError, SafetyStopError, ValueError) as error:
        raise click.ClickException(str(error)) from error


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
