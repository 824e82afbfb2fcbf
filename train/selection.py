"""Selection among the last checkpoints of a run and their moving average, by the recipe's goal.

The best checkpoint on the hands of one measurement is worse on others. Selection therefore uses hands without earlier
measurements and a lower confidence bound.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from aero.policy.file import Policy, load, save
from aero.whole_file import write_whole
from train.evaluation.cube_trial import CubeTrial
from train.evaluation.rollouts import run
from train.evaluation.trials import ANY_CUBE, figures, over_hands, run_trials
from train.hand_stock import hands_to_measure
from train.ppo import deployable, networks_of, untrained
from train.recipe import Recipe
from train.run_state import AVERAGE, CHECKPOINTS, RunFolderError, Standing, load_arrays
from train.trainer import EPISODE_S

CANDIDATES = 8
"""Number of last checkpoints that are compared."""
HELD_OUT = 60
"""Number of hands per candidate."""
HELD_OUT_SEED = 60_000
"""Seed of the held-out hands; no training uses it."""
FINALISTS = 2
"""Number of candidates that are compared through the bytes."""
CHOICE_SEED = 61_000_000
"""Seed of the first hand of the finalists' comparison; final figures use other seeds."""
CHOICE = "choice.json"


class Candidate(NamedTuple):
    """Checkpoint considered by the selection."""

    name: str
    policy: Policy
    bound_rad_s: float
    """Lower confidence bound of the value of a trial (`Goal.bound`)."""


def choose(
    recipe: Recipe,
    folder: Path,
    standing: Standing,
    *,
    hands: int,
    threads: int | None,
    say: Callable[[str], None],
    chooser: Mapping[str, Any],
) -> None:
    """Write the best of the last checkpoints and their average as the run's policy, and `choice.json` beside it.

    Args:
        recipe: recipe of the run.
        folder: folder of the run.
        standing: state of the run.
        hands: number of emulated hands with random cubes on which the best two are compared; 0 skips this.
        threads: number of threads; None for all cores.
        say: called with a line for each figure.
        chooser: provenance of the selecting program, stored in the policy's file.

    Raises:
        RunFolderError: the run has no checkpoint yet.
    """
    say(f"choosing on {HELD_OUT} held-out hands in process")
    found = ranked(recipe, folder, standing, threads=threads, say=say)
    best, rows = found[0], [{"name": one.name, "in_process": one.bound_rad_s} for one in found]
    if hands and recipe.stages[-1].built:
        say(f"comparing the best {FINALISTS} through every byte on {hands} hands with any cube")
        bounds = [_through_bytes(recipe, one, hands, say) for one in found[:FINALISTS]]
        for row, bound in zip(rows, bounds, strict=False):
            row["through_bytes"] = bound
        best = found[int(np.argmax(bounds))]
    said = {**best.policy.provenance, "chosen": best.name, "chosen_among": len(found), **chooser}
    save(replace(best.policy, provenance=said), folder / f"{recipe.name}.npz")
    write_whole(folder / CHOICE, json.dumps({"chosen": best.name, "candidates": rows}, indent=1))
    say(f"chosen: {best.name}")


def _through_bytes(recipe: Recipe, one: Candidate, hands: int, say: Callable[[str], None]) -> float:
    made: dict[str, list[CubeTrial]] = {}
    cases = over_hands(one.policy, hands, seconds=EPISODE_S, seed=CHOICE_SEED)
    run_trials(one.policy, cases, made, lambda _done, _name: None)
    row, trials = figures(made[ANY_CUBE]), made[ANY_CUBE]
    bound = recipe.goal.bound(np.array([t.rate_rad_s for t in trials]), np.array([t.kept for t in trials]))
    say(
        f"  {one.name}: keeps {row['survival']:.0%} ({row['survival_low']:.0%}-{row['survival_high']:.0%}), "
        f"{row['rate_rad_s']:.2f} rad/s, {row['turned_share']:.0%} above 0.1 rad/s, worth at least {bound:.2f}"
    )
    return bound


def ranked(
    recipe: Recipe, folder: Path, standing: Standing, *, threads: int | None, say: Callable[[str], None]
) -> list[Candidate]:
    """Return the last checkpoints of the current attempt and their average, best first; see `choose`."""
    stage = recipe.stages[standing.stage]
    task, settings = recipe.task_in(stage), recipe.task.settings
    paths = sorted((folder / CHECKPOINTS).glob(f"{standing.attempt}_*.npz"))[-CANDIDATES:]
    if not paths:
        raise RunFolderError(f"{folder} holds no checkpoint yet")
    paths.append(paths[-1].with_name(AVERAGE + paths[-1].name))
    normaliser, networks = jax.eval_shape(lambda key: untrained(networks_of(recipe), key), jax.random.PRNGKey(0))
    template = (normaliser, networks.policy, networks.value)
    of_training = load(folder / f"{recipe.name}.npz").provenance  # identical whatever program selects
    found = []
    with hands_to_measure(stage, settings, (HELD_OUT_SEED, standing.seed), HELD_OUT, threads=threads) as hands:
        for path in paths:
            steps = int(path.stem.rpartition("_")[2])
            about = {**of_training, "steps": steps, "averaged": path.name.startswith(AVERAGE)}
            policy = deployable(recipe.name, task, load_arrays(path, template), about)
            made = run(policy, task, hands, EPISODE_S, seed=HELD_OUT_SEED)
            found.append(Candidate(path.stem, policy, recipe.goal.bound(made.rate_rad_s, made.kept)))
            kept, rate_rad_s = made.kept.mean(), made.rate_rad_s.mean()
            say(f"  {path.stem}: keeps {kept:.0%}, {rate_rad_s:.2f} rad/s, worth at least {found[-1].bound_rad_s:.2f}")
    return sorted(found, key=lambda one: one.bound_rad_s, reverse=True)
