"""`aero-hil train`: make a policy."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from hil.cli.console import console as new_console
from hil.cli.exits import Ended, Exit, given
from hil.cli.options import SEED, Finite, NewFolder
from hil.recordings.output import prepared_folder
from hil.recordings.provenance import source_commit, versions
from train.evaluation.figures import check_video, video
from train.evaluation.rollouts import log
from train.progress import PICTURE, Checkpoint
from train.recipe import RECIPES, on_gpu, on_routed_hands

EPISODE_S = 15.0
WITHOUT_GPU = (
    "Warning: JAX finds no GPU here; MJX on a CPU is more than 100 times slower than `--backend native`, good for "
    "a smoke test. The recipe keeps its size for CPUs, not the paper's 8192 environments."
)
"""8.2 k environment steps/s and 44, on two cores (docs/training.md)."""


@click.command()
@click.argument("recipe", type=click.Choice(list(RECIPES)), default="steady")
@click.option(
    "--backend", type=click.Choice(["native", "mjx"]),
    help="Physics: `native` on all cores, `mjx` on GPUs; by default what this machine has.",
)  # fmt: skip
@click.option("--seed", type=SEED, default=0, show_default=True, help="Seed of everything that is drawn.")
@click.option(
    "--minutes",
    type=Finite(0.0, min_open=True),
    help="Wall time, restarts included; without it the recipe's steps decide.",
)
@click.option("--steps", type=click.IntRange(1, 10**12), help="Environment steps instead of the recipe's.")
@click.option("--resume", is_flag=True, help="Go on with the run in the folder.")
@click.option("--video", "with_video", is_flag=True, help="Render an episode of the best checkpoint at the end.")
@click.option(
    "--out", type=NewFolder(), default=Path("training"), show_default=True,
    help="Folder for the policy, the curve and the checkpoint.",
)  # fmt: skip
def train(
    *,
    recipe: str,
    backend: Literal["native", "mjx"] | None,
    seed: int,
    minutes: float | None,
    steps: int | None,
    resume: bool,
    with_video: bool,
    out: Path,
) -> None:
    """Train RECIPE, `steady` for the hand or `fast` for the record in simulation.

    The best checkpoint, by true rotation and survival, is written to the folder as it comes; Ctrl-C keeps it.
    """
    with given():
        prepared_folder(out)
        if with_video:
            check_video()
    try:
        from train import ppo  # noqa: PLC0415 - the extra is asked for where it is used
    except ImportError as error:
        raise Ended(f"training needs the extra `train` ({error})", Exit.USAGE) from error
    on = backend or ppo.machine_backend()
    console = new_console()
    chosen = RECIPES[recipe]
    if on == "mjx" and ppo.accelerated():
        chosen = on_gpu(chosen)
    elif on == "mjx":
        chosen = on_routed_hands(chosen)
        console.print(WITHOUT_GPU, soft_wrap=True)
    chosen = chosen.with_steps(steps) if steps else chosen
    console.print(f"{recipe} over {on}, seed {seed}, {chosen.environments} environments, {chosen.steps} steps")
    points: list[Checkpoint] = []

    def show(point: Checkpoint) -> None:
        points.append(point)
        console.print(_line(point), soft_wrap=True)

    made_with = {"commit": source_commit(), "versions": versions("jax", "brax", "mujoco-mjx")}
    try:
        policy = ppo.train(
            chosen, on, seed, out, minutes=minutes, resume=resume, provenance=made_with, on_checkpoint=show
        )
    except (FileExistsError, FileNotFoundError, ValueError) as error:
        raise Ended(str(error), Exit.USAGE) from error
    kept = (policy.provenance.get("attempt"), policy.provenance.get("steps"))
    for point in points:
        if (point.attempt, point.steps) == kept:
            console.print(f"kept: {_line(point)}", soft_wrap=True)
    console.print(f"{out / (recipe + '.npz')}, {out / PICTURE}")
    if with_video:
        video(log(policy, chosen.task, EPISODE_S, seed).positions, out / f"{recipe}.mp4")


def _line(point: Checkpoint) -> str:
    return (
        f"attempt {point.attempt}  {point.steps / 1e6:6.2f} M steps  {point.elapsed_s / 60:5.1f} min  "
        f"{point.steps_per_s:6.0f} steps/s  {point.rotation_rad:5.1f} rad  {point.rate_rad_s:5.2f} rad/s  "
        f"keeps {point.survival:4.0%}"
    )
