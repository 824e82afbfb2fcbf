"""`aero-hil train`: make a policy."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click
from rich.console import Console
from rich.table import Table

from train.progress import PICTURE, Checkpoint
from train.recipe import RECIPES, on_gpu

COLUMNS = ("attempt", "steps", "elapsed_s", "steps_per_s", "rotation_rad", "rate_rad_s", "survival", "airborne")


@click.command()
@click.argument("recipe", type=click.Choice(list(RECIPES)), default="steady")
@click.option(
    "--backend", type=click.Choice(["native", "mjx"]),
    help="Physics: `native` on all cores, `mjx` on GPUs; by default what this machine has.",
)  # fmt: skip
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of everything that is drawn.")
@click.option("--minutes", type=float, help="Wall time, restarts included; without it the recipe's steps decide.")
@click.option("--steps", type=int, help="Environment steps instead of the recipe's.")
@click.option("--resume", is_flag=True, help="Go on with the run in the folder.")
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), default=Path("training"), show_default=True,
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
    out: Path,
) -> None:
    """Train RECIPE, `steady` for the hand or `fast` for the record in simulation.

    The best checkpoint, by true rotation and survival, is written to the folder as it comes; Ctrl-C keeps it.
    """
    try:
        import jax  # noqa: PLC0415 - the extra is asked for before it is used

        from train.ppo import train as run  # noqa: PLC0415
    except ImportError as error:
        raise click.UsageError(f"training needs `pip install aero-hil[train]`: {error}") from error
    on = backend or ("mjx" if jax.default_backend() == "gpu" else "native")
    chosen = on_gpu(RECIPES[recipe]) if on == "mjx" else RECIPES[recipe]
    chosen = chosen.with_steps(steps) if steps else chosen
    console = Console()
    console.print(f"{recipe} over {on}, seed {seed}, {chosen.environments} environments, {chosen.steps} steps")
    points: list[Checkpoint] = []

    def show(point: Checkpoint) -> None:
        points.append(point)
        console.print("  ".join(f"{name} {_text(getattr(point, name))}" for name in COLUMNS), highlight=False)

    try:
        policy = run(chosen, on, seed, out, minutes=minutes, resume=resume, on_checkpoint=show)
    except (FileExistsError, FileNotFoundError, ValueError) as error:
        raise click.UsageError(str(error)) from error
    best = max(points, key=lambda point: point.score)
    table = Table("best of this call", *COLUMNS, title=f"{out / (recipe + '.npz')}, {out / PICTURE}")
    table.add_row(policy.name, *(_text(getattr(best, name)) for name in COLUMNS))
    console.print(table)


def _text(value: float) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
