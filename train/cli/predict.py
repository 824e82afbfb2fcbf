"""`aero-hil predict`: how would this policy do on a physical hand?"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace

import click
import numpy as np

from aero.firmware import FIRMWARE
from aero.policy.shipped import DEFAULT, find_policy
from aero.safety import unwinding
from hil.cli.exits import usage_errors
from hil.cli.options import SEED, Finite, Seconds
from hil.cli.terminal import ProgressBar, print_columns
from hil.cli.terminal import console as new_console
from model.scene import CUBE, Cube
from train.cli.evaluation_tables import share
from train.evaluation.cube_trial import CubeTrial
from train.evaluation.deployment import ANY_HAND, Deployment, load_deployments
from train.evaluation.simulation import beside_a_deployment
from train.evaluation.trial_set import TrialSet, trial_set, trial_set_of
from train.evaluation.trials import run_trials

MOST = 1_000_000
WIDTH = 120
"""Columns where no terminal says how many there are."""


@click.command()
@click.argument("policy_name", metavar="[POLICY]", default=DEFAULT)
@click.option(
    "--as", "deployment_name", type=click.Choice(list(load_deployments())), default="ros2-node", show_default=True,
    help="How it is run; docs/training.md has the table.",
)  # fmt: skip
@click.option("--trials", type=click.IntRange(1, MOST), default=80, show_default=True, help="Trials with a cube.")
@click.option("--seconds", type=Seconds(), default=15.0, show_default=True, help="Length of a trial.")
@click.option("--seed", type=SEED, default=0, show_default=True, help="Seed of the first trial.")
@click.option("--unit", help=f"Another hand than the deployment's: a unit, or `{ANY_HAND}` for a new one each trial.")
@click.option("--firmware", type=click.Choice(list(FIRMWARE)), help="Another firmware than the deployment's.")
@click.option(
    "--cube-mm", type=Finite(20.0, 100.0), default=1e3 * CUBE.side_m, show_default=True, help="Side of the cube."
)
@click.option("--cube-g", type=Finite(1.0, 1000.0), default=1e3 * CUBE.mass_kg, show_default=True, help="Its mass.")
@click.option(
    "--cube-friction", type=Finite(0.05, 2.0), default=CUBE.friction, show_default=True,
    help="Its coefficient of friction; below 0.2 the hand's own counts.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print data for programs.")
def predict(
    *,
    policy_name: str,
    deployment_name: str,
    trials: int,
    seconds: float,
    seed: int,
    unit: str | None,
    firmware: str | None,
    cube_mm: float,
    cube_g: float,
    cube_friction: float,
    as_json: bool,
) -> None:
    """Predict how POLICY, the shipped one or a file, turns a cube on a physical hand that is run in a named way.

    Emulated hands with a cube are run through every byte, as the deployment does it, and the simulator beside them.
    The cube is the paper's by default.
    """
    cube = Cube(1e-3 * cube_mm, 1e-3 * cube_g, cube_friction)
    with usage_errors():
        policy = find_policy(policy_name)
        deployment = load_deployments()[deployment_name]
        deployment = replace(deployment, unit=unit or deployment.unit, firmware=firmware or deployment.firmware)
        cases = deployment.cases(policy, trials, seconds=seconds, seed=seed, cube=cube)
    made: dict[str, list[CubeTrial]] = {}
    simulated: list[TrialSet] = []
    try:
        with unwinding(), ProgressBar(console=new_console(stderr=True), transient=True) as bar:
            task = bar.add_task("plain MuJoCo", total=1.0)
            settings = deployment.run_settings(seconds).settings or policy.settings
            episodes = beside_a_deployment(policy, settings, trials, seconds=seconds, seed=seed, cube=cube)
            simulated = [trial_set(name, one.kept, one.alive_s, one.rotation_rad) for name, one in episodes.items()]
            run_trials(policy, cases, made, lambda done, name: bar.update(task, completed=done, description=name))
    finally:  # what had ended is printed, whatever the ending
        found = [*simulated, *(trial_set_of(name, some) for name, some in made.items())]
        if as_json:
            rows = [{key: _json(value) for key, value in asdict(row).items()} for row in found]
            head = {"policy": policy.name, "deployment": asdict(deployment), "cube": asdict(cube)}
            click.echo(json.dumps(head | {"seconds": seconds, "seed": seed, "predictions": rows}, indent=1))
        else:
            _print(policy.name, deployment, cube, found, f"seeds {seed} to {seed + trials - 1}")


def _print(policy: str, deployment: Deployment, cube: Cube, found: Sequence[TrialSet], seeds: str) -> None:
    console = new_console(width=None if sys.stdout.isatty() else WIDTH)
    console.print(f"{policy}, run as {deployment.name}: {deployment.meaning}")
    heads = ("trials", "keeps (95 %)", "rad/s", "95 %", "turned, rad")
    rows = {}
    for row in found:
        slow, fast = row.rate_interval
        rows[row.name] = [
            str(row.trials),
            share(row.kept_share, row.kept_interval),
            f"{row.rate_rad_s:.3f}",
            "" if np.isnan(slow) else f"{slow:.3f} to {fast:.3f}",
            f"{row.turned_rad:.2f}",
        ]
    if deployment.measured_rad_s is not None:
        rows["measured on a physical hand"] = ["", "", f"{deployment.measured_rad_s:.3f}", "", ""]
    print_columns(console, "", heads, rows)
    console.print(
        f"cube of {1e3 * cube.side_m:g} mm, {1e3 * cube.mass_kg:g} g, friction {cube.friction:g}; "
        f"unit {deployment.unit}, firmware {deployment.firmware}, {seeds}"
    )
    if deployment.reference:
        console.print(deployment.reference)


def _json(value: object) -> object:
    """Return a value as JSON knows it: it has no NaN."""
    if isinstance(value, tuple):
        return None if any(np.isnan(value)) else list(value)
    return None if isinstance(value, float) and np.isnan(value) else value
