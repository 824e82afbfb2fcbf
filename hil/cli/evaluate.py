"""`aero-hil evaluate`: will this policy survive the hand?"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace
from importlib.util import find_spec
from pathlib import Path

import click
from rich.console import Console

from aero.policy.file import Policy
from aero.policy.shipped import DEFAULT, find_policy
from aero.policy.task import CHANNELS
from aero.safety import unwinding
from hil.cli.evaluation_tables import print_figures, print_gaps
from hil.cli.exits import given
from hil.cli.options import SEED, NewFolder, Seconds
from hil.cli.progress_bar import ProgressBar
from hil.policies.byte_evaluation import cases, figures, open_loop_gaps, run_trials
from hil.policies.cube_trial import Trial
from hil.policies.transmission_gap import ChannelGap
from hil.recordings.output import prepared_folder, write_whole
from train.evaluation.backends import in_plain_mujoco, on_built_hands, over_mjx
from train.evaluation.figures import check_video, video
from train.evaluation.rollouts import log, task_of
from train.task.grasp import NOMINAL_RESET

BACKENDS = ("mujoco", "mjx", "built", "bytes")
MOST = 1_000_000
"""Episodes, trials or hands that one may ask for."""
WIDTH = 120
"""Columns where no terminal says how many there are: for a name and the figures beside it."""


@click.command()
@click.argument("policy_name", metavar="[POLICY]", default=DEFAULT)
@click.option(
    "--on", "backends", type=click.Choice(BACKENDS), multiple=True, default=("mujoco", "built", "bytes"),
    show_default=True,
    help="What to run on: plain MuJoCo, MJX, built hands in process, emulated hands through every byte. Repeatable.",
)  # fmt: skip
@click.option(
    "--episodes",
    type=click.IntRange(1, MOST),
    default=100,
    show_default=True,
    help="Episodes of each condition in simulation.",
)
@click.option(
    "--trials",
    type=click.IntRange(1, MOST),
    default=10,
    show_default=True,
    help="Trials of each hand through the bytes.",
)
@click.option(
    "--units",
    type=click.IntRange(0, MOST),
    default=5,
    show_default=True,
    help="Random hands that share one set of trials.",
)
@click.option("--seconds", type=Seconds(), default=15.0, show_default=True, help="Length of an episode.")
@click.option("--seed", type=SEED, default=0, show_default=True, help="Seed of everything that is drawn.")
@click.option("--video", "with_video", is_flag=True, help="Render one episode.")
@click.option(
    "--out", type=NewFolder(), default=Path("evaluation"), show_default=True,
    help="Folder for evaluation.json, delay.png and policy.mp4.",
)  # fmt: skip
def evaluate(
    *,
    policy_name: str,
    backends: tuple[str, ...],
    episodes: int,
    trials: int,
    units: int,
    seconds: float,
    seed: int,
    with_video: bool,
    out: Path,
) -> None:
    """Measure POLICY, a shipped one (`steady`, the default, or `fast`) or a file: rotation, rate, survival and more.

    In simulation under its training conditions, a control period late, in the paper's deployment settings and behind a
    servo with a sweep of delays and lags; through the bytes on each shipped unit, on random ones and on each firmware.
    """
    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    with given():
        policy = find_policy(policy_name)
        prepared_folder(out)
        if with_video:
            check_video()
        if "mjx" in backends and find_spec("mujoco.mjx") is None:
            raise ValueError("--on mjx needs the extra `train`")
    results: dict[str, dict[str, dict[str, float]]] = {}
    gaps: tuple[ChannelGap, ...] = ()
    made_trials: dict[str, list[Trial]] = {}
    try:
        with unwinding(), ProgressBar(console=console, transient=True) as bar:
            task = bar.add_task("evaluating", total=1.0)

            def show(done: float, doing: str) -> None:
                bar.update(task, completed=done, description=doing)

            if "mujoco" in backends:
                results["plain MuJoCo"] = in_plain_mujoco(
                    policy, episodes, seconds=seconds, seed=seed, picture=out / "delay.png", progress=show
                )
            if "mjx" in backends:
                results["MJX"] = over_mjx(policy, episodes, seconds=seconds, seed=seed)
            if "built" in backends:
                results["built hands in process"] = on_built_hands(policy, episodes, seconds=seconds, seed=seed)
            if "bytes" in backends:
                run_trials(policy, cases(policy, trials, units, seconds=seconds, seed=seed), made_trials, show)
                gaps = _gaps(policy, seconds, seed)
    finally:  # what had ended is kept, whatever the ending
        if made_trials:
            results["every byte"] = figures(made_trials)
        report = {"policy": policy.name, "results": results, "open_loop": [_as_json(gap) for gap in gaps]}
        write_whole(out / "evaluation.json", json.dumps(report, indent=1))
        for backend, rows in results.items():
            print_figures(console, backend, rows)
    if gaps:
        print_gaps(console, gaps)
    if with_video:
        video(log(policy, task_of(policy), seconds, seed).positions, out / "policy.mp4")


def _gaps(policy: Policy, seconds: float, seed: int) -> tuple[ChannelGap, ...]:
    quiet = replace(policy.settings, noise=(0.0,) * CHANNELS)
    simulated = log(policy, replace(task_of(policy, quiet), reset=NOMINAL_RESET), seconds, seed)
    return open_loop_gaps(policy, simulated.actions, simulated.lengths, seconds=seconds, seed=seed)


def _as_json(gap: ChannelGap) -> dict[str, float | str]:
    return asdict(gap) | {"channel": gap.channel.label}
