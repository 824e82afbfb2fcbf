"""`aero-hil train`: training of a policy."""

import sys
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

import click

from aero.exit_code import Exit
from aero.regular_file import open_regular
from hil.cli.exits import Ended, usage_errors
from hil.cli.options import SEED, Finite
from hil.cli.output_files import FOLDER
from hil.dialogue.terminal import console as new_console
from hil.recordings.provenance import source_commit, versions
from train.recipe import RECIPES, on_gpu, on_routed_hands

WITHOUT_GPU = (
    "Warning: JAX finds no GPU here; MJX on a CPU is more than 100 times slower than `--backend native`, good for "
    "a smoke test. The recipe keeps its size for CPUs, not the paper's 8192 environments."
)
"""Measured: 8.2 k environment steps/s native against 44 with MJX, on two cores (docs/training.md)."""

ANOTHER_TASK = (
    "Warning: MJX cannot step the built hands of {0}. This trains another task, {1}: hands of the released simulator "
    "without spools, cables and pads, not the healthy population. `--backend native` trains {0}."
)


@click.command()
@click.argument("recipe", type=click.Choice(list(RECIPES)), default="steady")
@click.option(
    "--backend", type=click.Choice(["native", "mjx"]),
    help="Physics: `native` on all cores, `mjx` on a GPU; default: `mjx` if JAX finds a GPU.",
)  # fmt: skip
@click.option("--seed", type=SEED, default=0, show_default=True, help="Seed of all random numbers.")
@click.option(
    "--minutes",
    type=Finite(0.0, min_open=True),
    help="Limit of the wall time; a run that reaches it can be resumed. Default: no limit.",
)
@click.option("--steps", type=click.IntRange(1, 10**12), help="Environment steps instead of the recipe's.")
@click.option(
    "--from", "parameters", type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Checkpoint of another run; only the last stage is trained, from there.",
)  # fmt: skip
@click.option("--resume", is_flag=True, help="Continue the run in the folder.")
@click.option("--threads", type=click.IntRange(1, 1024), help="Threads of the native backend; all cores by default.")
@click.option(
    "--units", type=click.IntRange(0, 10_000), default=200, show_default=True,
    help="Random hands and cubes for the final comparison of the two best checkpoints; 0 skips it.",
)  # fmt: skip
@click.option(
    "--out", type=FOLDER, default=Path("training"), show_default=True,
    help="Folder of policy, learning curve and checkpoints.",
)  # fmt: skip
def train(
    *,
    recipe: str,
    backend: Literal["native", "mjx"] | None,
    seed: int,
    minutes: float | None,
    steps: int | None,
    parameters: Path | None,
    resume: bool,
    threads: int | None,
    units: int,
    out: Path,
) -> None:
    """Train a policy by a recipe: `steady` for the hand, `paper` for comparison.

    Ctrl-C, SIGTERM and `--minutes` end the training within seconds without loss: `--resume` continues to the weights of
    an uninterrupted run. Finally the last checkpoints and the average of their weights are compared on held-out hands;
    the best one is written.
    """
    with usage_errors():
        FOLDER.prepared(out)
    try:
        from train import selection, trainer  # noqa: PLC0415 - the extra is asked for where it is used
        from train.run_state import LARGEST_BYTES, STATE  # noqa: PLC0415
    except ImportError as error:
        raise Ended(f"training needs the extra `train` ({error})", Exit.USAGE) from error
    on = backend or trainer.machine_backend()
    console = new_console()
    chosen = RECIPES[recipe]
    if on == "mjx" and trainer.accelerated():
        chosen = on_gpu(chosen)
    elif on == "mjx":
        chosen = on_routed_hands(chosen)
        console.print(WITHOUT_GPU, highlight=False, soft_wrap=True)
    if chosen.name != recipe:
        console.print(ANOTHER_TASK.format(recipe, chosen.name), highlight=False, soft_wrap=True)
    chosen = chosen.last_stage() if parameters else chosen
    chosen = chosen.with_steps(steps) if steps else chosen
    console.print(f"{chosen.name} over {on}, seed {seed}, {chosen.environments} environments, {chosen.steps} steps")

    def say(line: str) -> None:
        console.print(line, soft_wrap=True)

    made_with: dict[str, Any] = {"commit": source_commit(), "versions": versions("jax", "brax", "mujoco")}
    if parameters:
        with usage_errors(), open_regular(parameters, LARGEST_BYTES) as stream:
            made_with["from_sha256"] = sha256(stream.read()).hexdigest()
    try:
        ended = trainer.train(
            chosen,
            on,
            seed,
            out,
            minutes=minutes,
            threads=threads,
            resume=resume,
            parameters=parameters,
            provenance=made_with,
            say=say,
        )
        done = f"{ended.standing.steps / 1e6:.2f} M of {chosen.steps / 1e6:.2f} M steps"
        say(f"{ended.ending.value}: {done}, in {out}")
        if ended.ending is trainer.StopReason.DONE:
            chooser = {"chosen_at_commit": source_commit()}
            selection.choose(chosen, out, ended.standing, hands=units, threads=threads, say=say, chooser=chooser)
        elif not (out / STATE).exists():
            say(f"Nothing is kept in {out}: the run ended before its first update.")
        else:
            policy = f"{chosen.name}.npz"
            best = f", every checkpoint and the best one, {policy}" if (out / policy).exists() else ""
            bound = f" --steps {steps}" if steps else ""
            bound += f" --from {parameters}" if parameters else ""
            say(f"Kept in {out}: the state{best}.")
            say(f"To continue: aero-hil train {recipe} --seed {seed}{bound} --out {out} --resume")
    except KeyboardInterrupt:
        say(f"Every checkpoint is kept in {out}. To choose again: the same command with --resume")
        raise
    if ended.by_signal:
        sys.exit(128 + ended.by_signal)
