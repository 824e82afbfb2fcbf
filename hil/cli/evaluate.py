"""`aero-hil evaluate`: will this policy survive the hand?"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import asdict, replace
from importlib.util import find_spec
from pathlib import Path

import click
import numpy as np
from rich.console import Console

from aero.policy.file import Policy
from aero.policy.shipped import DEFAULT, find_policy
from aero.policy.task import CHANNELS
from aero.safety import unwinding
from aero.whole_file import write_whole
from hil.cli.evaluation_tables import print_figures, print_gaps, print_lost, print_strata, print_survival
from hil.cli.exits import usage_errors
from hil.cli.options import SEED, NewFolder, Seconds
from hil.cli.terminal import ProgressBar
from hil.cli.terminal import console as new_console
from hil.lab.policies.any_cube import ANY_CUBE, over_any, over_corrections, over_disturbances
from hil.lab.policies.byte_evaluation import (
    Case,
    cases,
    figures,
    open_loop_gaps,
    over_cubes,
    over_long,
    run_trials,
)
from hil.lab.policies.cube_trial import CubeTrial
from hil.lab.policies.mismatches import lost, mismatch_picture, over_mismatches
from hil.lab.policies.strata import cube_picture, strata, strata_picture
from hil.lab.policies.survival import survival_picture
from hil.lab.policies.transmission_gap import ChannelGap
from hil.recordings.output import prepared_folder
from train.evaluation.backends import in_plain_mujoco, on_built_hands, over_mjx
from train.evaluation.figures import check_video, video
from train.evaluation.rollouts import log, task_of
from train.task.grasp import NOMINAL_RESET

BACKENDS = ("mujoco", "mjx", "built", "bytes", "cubes", "any", "disturbed", "corrections", "mismatches", "long")
FRESH_SEEDS = 2**31
"""A seed that is not given is drawn below it."""
MOST = 1_000_000
"""Episodes, trials or hands that one may ask for."""
OTHER_CUBES = "every byte, other cubes, a random corrected hand each trial"
TITLES = {
    "bytes": "every byte",
    "cubes": OTHER_CUBES,
    "any": "every byte, any cube, a random corrected hand each trial, right and left",
    "disturbed": "the same, disturbed",
    "corrections": "the same, as well as the hand is known",
    "mismatches": "every byte, one mismatch between simulator and hand at a time",
    "long": "every byte, ten minutes",
}
WIDTH = 120
"""Columns where no terminal says how many there are: for a name and the figures beside it."""


@click.command()
@click.argument("policy_name", metavar="[POLICY]", default=DEFAULT)
@click.option(
    "--on", "backends", type=click.Choice(BACKENDS), multiple=True, default=("mujoco", "built", "bytes", "cubes"),
    show_default=True,
    help="What to run on: plain MuJoCo, MJX, built hands in process, emulated hands through every byte, the same with "
    "other cubes, any cube on each of the random hands, disturbed, corrected well and badly, "
    "the map's hand with one mismatch at a time, and ten minutes each. Repeatable.",
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
    help="Random hands that share one set of trials; with `--on any` and `--on disturbed` each has one.",
)
@click.option(
    "--twins", type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="For `--on corrections`: folder of unit files fitted to recordings of these hands, named SEED.toml.",
)  # fmt: skip
@click.option("--seconds", type=Seconds(), default=15.0, show_default=True, help="Length of an episode.")
@click.option("--seed", type=SEED, help="Seed of everything that is drawn; a fresh one, which is said, if not given.")
@click.option("--video", "with_video", is_flag=True, help="Render one episode.")
@click.option(
    "--out", type=NewFolder(), default=Path("evaluation"), show_default=True,
    help="Folder for evaluation.json, the pictures and policy.mp4.",
)  # fmt: skip
def evaluate(
    *,
    policy_name: str,
    backends: tuple[str, ...],
    episodes: int,
    trials: int,
    units: int,
    twins: Path | None,
    seconds: float,
    seed: int | None,
    with_video: bool,
    out: Path,
) -> None:
    """Measure POLICY, a shipped one (`steady`, the default, or `fast`) or a file: rotation, rate, survival and more.

    In simulation under its training conditions, a control period late, in the paper's deployment settings and behind a
    servo with a sweep of delays and lags; through the bytes on each shipped unit, on random ones and on each firmware,
    and with cubes of other sizes, masses, frictions and centres of mass.
    """
    console = new_console(width=None if sys.stdout.isatty() else WIDTH)
    with usage_errors():
        policy = find_policy(policy_name)
        _prepare(out, backends, with_video=with_video)
    seed = int(np.random.default_rng().integers(FRESH_SEEDS)) if seed is None else seed
    console.print(f"seed {seed}")
    results: dict[str, dict[str, dict[str, float]]] = {}
    gaps: tuple[ChannelGap, ...] = ()
    through_bytes: dict[str, Callable[[], list[Case]]] = {
        "bytes": lambda: cases(policy, trials, units, seconds=seconds, seed=seed),
        "cubes": lambda: over_cubes(policy, trials, seconds=seconds, seed=seed),
        "any": lambda: over_any(policy, units, seconds=seconds, seed=seed),
        "disturbed": lambda: over_disturbances(policy, units, seconds=seconds, seed=seed),
        "corrections": lambda: over_corrections(policy, units, seconds=seconds, seed=seed, twins=twins),
        "mismatches": lambda: over_mismatches(trials, seconds=seconds, seed=seed),
        "long": lambda: over_long(policy, trials, seed=seed),
    }
    made: dict[str, dict[str, list[CubeTrial]]] = {}
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
            for backend, listed in through_bytes.items():
                if backend in backends:
                    run_trials(policy, listed(), made.setdefault(backend, {}), show)
            if "bytes" in backends:
                gaps = _gaps(policy, seconds, seed)
    finally:  # what had ended is kept, whatever the ending
        results |= {TITLES[backend]: figures(rows) for backend, rows in made.items() if rows}
        _draw(results, made, out)
        report = {"policy": policy.name, "seed": seed, "results": results, "open_loop": [_as_json(gap) for gap in gaps]}
        write_whole(out / "evaluation.json", json.dumps(report, indent=1))
        for title, rows in results.items():
            print_figures(console, title, rows)
        _say(console, made)
    if gaps:
        print_gaps(console, gaps)
    if with_video:
        video(log(policy, task_of(policy), seconds, seed).positions, out / "policy.mp4")


def _say(console: Console, made: dict[str, dict[str, list[CubeTrial]]]) -> None:
    """Print the tables of what was made that divide or compare its trials."""
    if made.get("any"):
        print_strata(console, strata(made["any"][ANY_CUBE]))
    if made.get("mismatches"):
        print_lost(console, lost(made["mismatches"]))
    if made.get("long"):
        print_survival(console, made["long"])


def _draw(
    results: dict[str, dict[str, dict[str, float]]], made: dict[str, dict[str, list[CubeTrial]]], out: Path
) -> None:
    """Draw the pictures of what was made."""
    if made.get("cubes"):
        cube_picture(results[OTHER_CUBES], out / "cubes.png")
    if made.get("any"):
        strata_picture(made["any"][ANY_CUBE], out / "strata.png")
    if made.get("mismatches"):
        mismatch_picture(lost(made["mismatches"]), out / "mismatches.png")
    if made.get("long"):
        survival_picture(made["long"], out / "survival.png")


def _prepare(out: Path, backends: tuple[str, ...], *, with_video: bool) -> None:
    """Try what is needed before any work."""
    prepared_folder(out)
    if with_video:
        check_video()
    if "mjx" in backends and find_spec("mujoco.mjx") is None:
        raise ValueError("--on mjx needs the extra `train`")


def _gaps(policy: Policy, seconds: float, seed: int) -> tuple[ChannelGap, ...]:
    quiet = replace(policy.settings, noise=(0.0,) * CHANNELS)
    simulated = log(policy, replace(task_of(policy, quiet), reset=NOMINAL_RESET), seconds, seed)
    return open_loop_gaps(policy, simulated.actions, simulated.lengths, seconds=seconds, seed=seed)


def _as_json(gap: ChannelGap) -> dict[str, float | str]:
    return asdict(gap) | {"channel": gap.channel.label}
