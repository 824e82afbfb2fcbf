"""`aero-hil evaluate`: survival and rotation rate of a policy on emulated hands."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import isnan, nan
from pathlib import Path

import click
import numpy as np
from click.core import ParameterSource
from rich.console import Console

from aero.policy.file import Policy
from aero.policy.loop import interface_of
from aero.policy.shipped import DEFAULT, find_policy
from aero.safety import unwinding
from aero.whole_file import write_whole
from hil.cli.exits import usage_errors
from hil.cli.options import SECONDS, SEED, Finite
from hil.cli.output_files import FOLDER
from hil.dialogue.terminal import ProgressBar, print_columns
from hil.dialogue.terminal import console as new_console
from hil.recordings.output import json_text
from simulator.scene import CUBE, Cube
from train.evaluation.cube_trial import CubeTrial
from train.evaluation.simulation import beside_a_deployment, measure
from train.evaluation.trials import CORRECTIONS, Case, figures, load_deployments, over_hands, run_trials

ON = ("simulation", "hands")
FRESH_SEEDS = 2**31
"""Upper bound of a random seed."""
MOST = 1_000_000
"""Limit of episodes or hands per call."""
WIDTH = 120
"""Table width without a terminal, columns."""
FIGURES = {
    "survival": ("keeps", "{:.0%}"),
    "wedged": ("wedged", "{:.0%}"),
    "rate_rad_s": ("rad/s", "{:.2f}"),
    "rotation_median_rad": ("rad", "{:.1f}"),
    "turned_share": ("> 0.1", "{:.0%}"),
    "airborne": ("no contact", "{:.2%}"),
    "let_go": ("> 0.5 mm", "{:.2%}"),
    "finger_travel_m_s": ("mm/s", "{:.1f}"),
    "stopped": ("stopped", "{:.0%}"),
    "mean_current_a": ("mean A", "{:.2f}"),
    "peak_current_a": ("peak A", "{:.2f}"),
    "held_15_s": ("held 15 s", "{:.0%}"),
    "held_50_s": ("held 50 s", "{:.0%}"),
    "held_200_s": ("held 200 s", "{:.0%}"),
}
"""Heading and format of each figure, in the order of the table.

Survival, wedged cubes, rate, median rotation, share above 0.1 rad/s, steps without contact, samples with nothing within
0.5 mm of the cube, commanded travel of a finger, share of trials with an early end, mean and peak current of the motor
with the highest current, survival after a time.
"""
SCALE = {"finger_travel_m_s": 1e3}


@click.command()
@click.argument("policy_name", metavar="[POLICY]", default=DEFAULT)
@click.option(
    "--on", "backends", type=click.Choice(ON), multiple=True, default=ON, show_default=True,
    help="`simulation`: MuJoCo alone; `hands`: emulated hands with board and bus, random cubes. Repeatable.",
)  # fmt: skip
@click.option(
    "--as", "deployment_name", type=click.Choice(list(load_deployments())),
    help="Predict a physical hand under this deployment, beside plain MuJoCo.",
)  # fmt: skip
@click.option("--seconds", type=SECONDS, default=15.0, show_default=True, help="Length of a trial, s.")
@click.option("--seed", type=SEED, help="Seed of all random numbers; default: a fresh one, which is printed.")
@click.option(
    "--episodes", type=click.IntRange(1, MOST), default=100, show_default=True,
    help="Simulation: number of episodes per condition.",
)  # fmt: skip
@click.option(
    "--units", type=click.IntRange(1, MOST), default=20, show_default=True,
    help="Number of hands, right and left in turn, each with a random cube; with --as, number of trials.",
)  # fmt: skip
@click.option(
    "--correction", "correct", type=click.Choice(CORRECTIONS), default=CORRECTIONS[0], show_default=True,
    help="Hands: cable-length correction; `measured` at the start of each trial, as by run-policy; `wrong` is the "
    "exact one with a random error of 0.5 mm per cable.",
)  # fmt: skip
@click.option(
    "--cables", "cables_mm", type=Finite(0.0, 10.0), default=0.0, show_default=True,
    help="Hands: largest error of each cable's length, mm, drawn uniformly.",
)  # fmt: skip
@click.option(
    "--cube", "cube_size", type=(Finite(20.0, 100.0), Finite(1.0, 1000.0), Finite(0.05, 2.0)), metavar="MM G FRICTION",
    default=(1e3 * CUBE.side_m, 1e3 * CUBE.mass_kg, CUBE.friction), show_default=True,
    help="With --as: side, mass and friction of the cube; the contact friction is at least the hand's 0.2.",
)  # fmt: skip
@click.option(
    "--out", type=FOLDER, default=Path("evaluation"), show_default=True,
    help="Folder of evaluation.json.",
)  # fmt: skip
@click.pass_context
def evaluate(
    context: click.Context,
    *,
    policy_name: str,
    backends: tuple[str, ...],
    deployment_name: str | None,
    seconds: float,
    seed: int | None,
    episodes: int,
    units: int,
    correct: str,
    cables_mm: float,
    cube_size: tuple[float, float, float],
    out: Path,
) -> None:
    """Measure survival and rotation rate of POLICY, `steady` (shipped, the default) or a file.

    A trial of 15 s on an emulated hand takes about a second of a core; all cores are used.
    """
    console = new_console(width=None if sys.stdout.isatty() else WIDTH)
    seed = int(np.random.default_rng().integers(FRESH_SEEDS)) if seed is None else seed
    decided = ("cube_size",) if deployment_name is None else ("correct", "cables_mm")
    if given := [name for name in decided if context.get_parameter_source(name) is not ParameterSource.DEFAULT]:
        options = ", ".join(option.opts[0] for option in context.command.params if option.name in given)
        raise click.UsageError(f"{options} cannot be used {'without' if deployment_name is None else 'with'} --as")
    deployment = load_deployments()[deployment_name] if deployment_name else None
    cube = Cube(1e-3 * cube_size[0], 1e-3 * cube_size[1], cube_size[2])
    with usage_errors():
        policy = find_policy(policy_name)
        FOLDER.prepared(out)
        cases = []
        if "hands" in backends and deployment:
            cases = deployment.cases(policy, units, seconds=seconds, seed=seed, cube=cube)
        elif "hands" in backends:
            cases = over_hands(policy, units, seconds=seconds, seed=seed, correct=correct, cables_m=1e-3 * cables_mm)
        _check_fit(policy, backends, cases)
    console.print(f"seed {seed}")
    results: dict[str, dict[str, dict[str, float]]] = {}
    made: dict[str, list[CubeTrial]] = {}
    try:
        with unwinding(), ProgressBar() as bar:
            task = bar.add_task("evaluating", total=1.0)

            def show(done: float, doing: str) -> None:
                bar.update(task, completed=done, description=doing)

            if "simulation" in backends and deployment:
                settings = deployment.run_settings(seconds).settings or policy.settings
                rows = beside_a_deployment(policy, settings, episodes, seconds=seconds, seed=seed, cube=cube)
                results["simulation"] = {name: one.summary() for name, one in rows.items()}
            elif "simulation" in backends:
                results["simulation"] = measure(policy, episodes, seconds=seconds, seed=seed, progress=show)
            if cases:
                run_trials(policy, cases, made, show)
    finally:  # write finished trials, whatever the ending
        if made:
            results["hands"] = {row: figures(done) for row, done in made.items()}
        report = {"policy": policy.name, "seed": seed, "results": results}
        if deployment:
            report |= {"deployment": asdict(deployment), "cube": asdict(cube)}
        write_whole(out / "evaluation.json", json_text(report))
        for title, rows_of in results.items():
            print_figures(console, title, rows_of)
        if deployment and deployment.measured_rad_s is not None:
            console.print(f"{deployment.name}: a physical hand turned the cube by {deployment.measured_rad_s:g} rad/s")


def _check_fit(policy: Policy, backends: Sequence[str], cases: Sequence[Case]) -> None:
    """Raise for a policy of the user's that does not fit the simulator or the cube task.

    Raises:
        ValueError: the simulator, or settings of the cube task.
    """
    if policy.declared is not None and "simulation" in backends:
        raise ValueError(f"{policy.name} runs on emulated hands only: use --on hands")
    for case in cases[:1]:
        interface_of(policy, case.settings)


def print_figures(console: Console, title: str, rows: Mapping[str, Mapping[str, float]]) -> None:
    """Print one row per condition and one column per figure, with its 95 % interval if known."""
    shown = {key: column for key, column in FIGURES.items() if any(key in row for row in rows.values())}
    heads = [head for head, _ in shown.values()]
    cells = {name: [_cell(row, key, form) for key, (_, form) in shown.items()] for name, row in rows.items()}
    print_columns(console, title, heads, cells)


def _cell(row: Mapping[str, float], key: str, form: str) -> str:
    if key not in row:
        return ""
    scale = SCALE.get(key, 1.0)
    low, high = row.get(f"{key}_low", nan), row.get(f"{key}_high", nan)
    interval = "" if isnan(low) else f" ({form.format(low * scale)}-{form.format(high * scale)})"
    return form.format(row[key] * scale) + interval
