"""`aero-hil evaluate`: will this policy survive the hand?"""

from __future__ import annotations

import sys
from pathlib import Path

import click
import numpy as np
from rich.console import Console

from aero.policy.shipped import DEFAULT, find_policy
from aero.safety import unwinding
from aero.whole_file import write_whole
from hil.cli.exits import usage_errors
from hil.cli.options import SEED, NewFolder, Seconds
from hil.cli.terminal import ProgressBar
from hil.cli.terminal import console as new_console
from hil.recordings.output import json_text, prepared_folder
from train.cli.evaluation_tables import print_figures, print_lost, print_strata
from train.evaluation.cube_trial import CubeTrial
from train.evaluation.mismatches import lost, mismatch_picture, over_mismatches
from train.evaluation.simulation import measure
from train.evaluation.strata import strata, strata_picture
from train.evaluation.trials import ANY_CUBE, CORRECTIONS, DISTURBANCES, figures, over_hands, run_trials

ON = ("simulation", "hands", "mismatches")
FRESH_SEEDS = 2**31
"""A seed that is not given is drawn below it."""
MOST = 1_000_000
"""Episodes, trials or hands that one may ask for."""
WIDTH = 120
"""Columns where no terminal says how many there are."""


@click.command()
@click.argument("policy_name", metavar="[POLICY]", default=DEFAULT)
@click.option(
    "--on", "backends", type=click.Choice(ON), multiple=True, default=("simulation", "hands"), show_default=True,
    help="`simulation` in this process, `hands`: any cube on fresh emulated hands through every byte, `mismatches`: "
    "one difference between simulator and hand at a time. Repeatable.",
)  # fmt: skip
@click.option("--seconds", type=Seconds(), default=15.0, show_default=True, help="Length of a trial.")
@click.option("--seed", type=SEED, help="Seed of everything that is drawn; a fresh one, which is printed, by default.")
@click.option(
    "--episodes", type=click.IntRange(1, MOST), default=100, show_default=True,
    help="Simulation: episodes of each condition.",
)  # fmt: skip
@click.option(
    "--units", type=click.IntRange(1, MOST), default=20, show_default=True,
    help="Hands: how many, right and left in turn, each with a cube of its own.",
)  # fmt: skip
@click.option(
    "--correction", "correct", type=click.Choice(CORRECTIONS), default=CORRECTIONS[0], show_default=True,
    help="Hands: which correction of the cables; `wrong` is the exact one, off by 0.5 mm each (standard deviation).",
)  # fmt: skip
@click.option(
    "--twins", type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Hands: folder of unit files that `aero-hil calibrate` fitted to these hands, named SEED.toml.",
)  # fmt: skip
@click.option(
    "--disturbance", type=click.Choice(list(DISTURBANCES)), default="none", show_default=True,
    help="Hands: gravity 20 degrees off, the cube shoved by 0.2 m/s, the hand jolted by 10 m/s² for 0.1 s.",
)  # fmt: skip
@click.option(
    "--trials", type=click.IntRange(1, MOST), default=10, show_default=True, help="Mismatches: trials of each."
)
@click.option(
    "--out", type=NewFolder(), default=Path("evaluation"), show_default=True,
    help="Folder for evaluation.json and the pictures.",
)  # fmt: skip
def evaluate(
    *,
    policy_name: str,
    backends: tuple[str, ...],
    seconds: float,
    seed: int | None,
    episodes: int,
    units: int,
    correct: str,
    twins: Path | None,
    disturbance: str,
    trials: int,
    out: Path,
) -> None:
    """Measure POLICY, the shipped one (`steady`, the default) or a file: does it keep the cube, how fast does it turn?

    A trial through every byte takes about a second of a core for 15 s, and all cores work.
    """
    console = new_console(width=None if sys.stdout.isatty() else WIDTH)
    seed = int(np.random.default_rng().integers(FRESH_SEEDS)) if seed is None else seed
    with usage_errors():
        policy = find_policy(policy_name)
        prepared_folder(out)
        cases = {
            "hands": over_hands(
                policy, units, seconds=seconds, seed=seed, disturbance=DISTURBANCES[disturbance],
                correct=correct, twins=twins,
            ) if "hands" in backends else [],
            "mismatches": over_mismatches(trials, seconds=seconds, seed=seed) if "mismatches" in backends else [],
        }  # fmt: skip
    console.print(f"seed {seed}")
    results: dict[str, dict[str, dict[str, float]]] = {}
    made: dict[str, dict[str, list[CubeTrial]]] = {name: {} for name in cases}
    try:
        with unwinding(), ProgressBar(console=console, transient=True) as bar:
            task = bar.add_task("evaluating", total=1.0)

            def show(done: float, doing: str) -> None:
                bar.update(task, completed=done, description=doing)

            if "simulation" in backends:
                results["simulation"] = measure(
                    policy, episodes, seconds=seconds, seed=seed, picture=out / "delay.png", progress=show
                )
            for name, listed in cases.items():
                if listed:
                    run_trials(policy, listed, made[name], show)
    finally:  # what had ended is written, whatever the ending
        results |= {name: {row: figures(done) for row, done in rows.items()} for name, rows in made.items() if rows}
        report = {"policy": policy.name, "seed": seed, "results": results}
        write_whole(out / "evaluation.json", json_text(report))
        for title, rows in results.items():
            print_figures(console, title, rows)
        _show(console, made, out)


def _show(console: Console, made: dict[str, dict[str, list[CubeTrial]]], out: Path) -> None:
    """Print and draw what divides or compares the trials."""
    if hands := made["hands"].get(ANY_CUBE):
        print_strata(console, strata(hands))
        strata_picture(hands, out / "strata.png")
    if made["mismatches"]:
        rows = lost(made["mismatches"])
        print_lost(console, rows)
        mismatch_picture(rows, out / "mismatches.png")
