"""`aero-hil predict`: how would this policy do on a physical hand?"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace

import click
import numpy as np
from rich.table import Table

from aero.firmware import FIRMWARE
from aero.policy.shipped import DEFAULT, find_policy
from aero.safety import unwinding
from hil.cli.exits import usage_errors
from hil.cli.options import SEED, Seconds
from hil.cli.terminal import ProgressBar
from hil.cli.terminal import console as new_console
from hil.lab.policies.byte_evaluation import run_trials
from hil.lab.policies.cube_trial import CubeTrial
from hil.lab.policies.deployment import ANY_HAND, Deployment, load_deployments
from hil.lab.policies.prediction import Prediction, of_trials, predicted
from train.evaluation.backends import beside_a_deployment

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
    as_json: bool,
) -> None:
    """Predict how POLICY, a shipped one or a file, turns a cube on a physical hand that is run in a named way.

    Emulated hands with a cube are run through every byte, as the deployment does it, and the simulator beside them.
    """
    with usage_errors():
        policy = find_policy(policy_name)
        deployment = load_deployments()[deployment_name]
        deployment = replace(deployment, unit=unit or deployment.unit, firmware=firmware or deployment.firmware)
        cases = deployment.cases(policy, trials, seconds=seconds, seed=seed)
    made: dict[str, list[CubeTrial]] = {}
    simulated: list[Prediction] = []
    try:
        with unwinding(), ProgressBar(console=new_console(stderr=True), transient=True) as bar:
            task = bar.add_task("plain MuJoCo", total=1.0)
            settings = deployment.run_settings(seconds).settings or policy.settings
            for name, done in beside_a_deployment(policy, settings, trials, seconds=seconds, seed=seed).items():
                rates, turned = done.rate_rad_s.tolist(), done.rotation_rad.tolist()
                simulated.append(predicted(name, done.kept.tolist(), rates, turned, seed=seed))
            run_trials(policy, cases, made, lambda done, name: bar.update(task, completed=done, description=name))
    finally:  # what had ended is said, whatever the ending
        found = [*simulated, *(of_trials(name, some, seed) for name, some in made.items())]
        if as_json:
            rows = [{key: _json(value) for key, value in asdict(row).items()} for row in found]
            said = {"policy": policy.name, "deployment": asdict(deployment), "seconds": seconds, "seed": seed}
            click.echo(json.dumps(said | {"predictions": rows}, indent=1))
        else:
            _print(policy.name, deployment, found, seed, trials)


def _print(policy: str, deployment: Deployment, found: Sequence[Prediction], seed: int, trials: int) -> None:
    console = new_console(width=None if sys.stdout.isatty() else WIDTH)
    table = Table(title=f"{policy}, run as {deployment.name}: {deployment.meaning}", title_justify="left")
    table.add_column("", no_wrap=True)
    for title in ("trials", "kept", "95 %", "rad/s", "95 %", "turned, rad"):
        table.add_column(title, justify="right")
    for row in found:
        low, high = row.kept_interval
        slow, fast = row.rate_interval
        table.add_row(
            row.name,
            str(row.trials),
            f"{row.kept / row.trials:.0%}",
            f"{low:.0%} to {high:.0%}",
            f"{row.rate_rad_s:.3f}",
            "" if np.isnan(slow) else f"{slow:.3f} to {fast:.3f}",
            f"{row.turned_rad:.2f}",
        )
    if deployment.measured_rad_s is not None:
        table.add_row("measured on a physical hand", "", "", "", f"{deployment.measured_rad_s:.3f}", "", "")
    console.print(table)
    console.print(
        f"unit {deployment.unit}, firmware {deployment.firmware}, seeds {seed} to {seed + trials - 1}",
        highlight=False,
    )  # fmt: skip
    if deployment.reference:
        console.print(deployment.reference)


def _json(value: object) -> object:
    """Return a value as JSON knows it: it has no NaN."""
    if isinstance(value, tuple):
        return None if any(np.isnan(value)) else list(value)
    return value
