"""Choose among the last checkpoints of a run, and the moving average of its weights, by what is asked for.

A checkpoint that was best on the hands it was chosen on is worse on others; so the choice is on hands that no
checkpoint was measured on, and by a lower confidence bound.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from aero.policy.file import Policy, load, save
from aero.whole_file import write_whole
from train.evaluation.cube_trial import CubeTrial
from train.evaluation.rollouts import run
from train.evaluation.trials import ANY_CUBE, figures, over_hands, run_trials
from train.hand_stock import hands_to_measure
from train.ppo import deployable, networks_of, untrained
from train.recipe import Goal, Recipe
from train.run_state import AVERAGE, CHECKPOINTS, RunFolderError, Standing, load_arrays
from train.simulator import Floats
from train.trainer import EPISODE_S

CANDIDATES = 8
"""Last checkpoints among which is chosen."""
HELD_OUT = 60
"""Hands that each is measured on."""
HELD_OUT_SEED = 60_000
"""Of these hands; no training has it."""
CONFIDENCE_Z = 1.645
"""One-sided 95 %."""
FINALISTS = 2
"""Candidates that are compared through the bytes."""
CHOICE_SEED = 61_000_000
"""Seed of the first hand that they are compared on; final figures take others."""
CHOICE = "choice.json"


@dataclass(frozen=True)
class Candidate:
    """A checkpoint that might be chosen."""

    name: str
    policy: Policy
    kept: float
    """Share of the hands that kept the cube."""
    rate_rad_s: float
    """Mean."""
    bound_rad_s: float
    """Lower confidence bound of what a trial is worth (`Goal.worth`)."""


def choose(
    recipe: Recipe,
    folder: Path,
    standing: Standing,
    *,
    hands: int,
    threads: int | None,
    say: Callable[[str], None],
    chooser: dict[str, Any],
) -> None:
    """Write the best of the last checkpoints and their average as the run's policy.

    Args:
        recipe: of the run.
        folder: of the run; gets the policy and `choice.json`.
        standing: where the run stands.
        hands: random hands with any cube on which the best two are compared through the bytes; 0 leaves that out.
        threads: None for all cores.
        say: gets a line for each figure.
        chooser: what the policy's file says of the program that chose.

    Raises:
        FileNotFoundError: there is no checkpoint yet.
    """

    def show(one: Candidate) -> None:
        say(f"  {one.name}: keeps {one.kept:.0%}, {one.rate_rad_s:.2f} rad/s, worth at least {one.bound_rad_s:.2f}")

    say(f"choosing on {HELD_OUT} held-out hands in process")
    about = load(folder / f"{recipe.name}.npz").provenance  # of the training, whatever program chooses
    found = ranked(recipe, folder, standing, dict(about), threads=threads, on_candidate=show)
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
    bound = lower_bound(recipe.goal, np.array([t.rate_rad_s for t in trials]), np.array([t.kept for t in trials]))
    say(
        f"  {one.name}: keeps {row['survival']:.0%} ({row['survival_low']:.0%}-{row['survival_high']:.0%}), "
        f"{row['rate_rad_s']:.2f} rad/s, "
        f"{row['turned_share']:.0%} above 0.1 rad/s, worth at least {bound:.2f}"
    )
    return bound


def lower_bound(goal: Goal, rates_rad_s: Floats, kept: np.ndarray) -> float:
    """Return the one-sided lower 95 % bound of the mean worth of trials, rad/s; arrays are (trials,)."""
    worth = goal.worth(rates_rad_s, kept)
    return float(worth.mean() - CONFIDENCE_Z * worth.std(ddof=1) / np.sqrt(len(worth)))


def ranked(
    recipe: Recipe,
    folder: Path,
    standing: Standing,
    provenance: dict[str, Any],
    *,
    threads: int | None = None,
    on_candidate: Callable[[Candidate], None] = lambda _: None,
) -> list[Candidate]:
    """Return the last checkpoints of a run and its average, the best first.

    Args:
        recipe: of the run.
        folder: of the run.
        standing: where it stands; checkpoints of its attempt count.
        provenance: what the policies' files are to say besides their steps.
        threads: None for all cores.
        on_candidate: called with each candidate as it is measured.

    Raises:
        RunFolderError: there is no checkpoint.
    """
    stage = recipe.stages[standing.stage]
    task, settings = recipe.task_in(stage), recipe.task.settings
    paths = sorted((folder / CHECKPOINTS).glob(f"{standing.attempt}_*.npz"))[-CANDIDATES:]
    if not paths:
        raise RunFolderError(f"{folder} holds no checkpoint yet")
    paths.append(paths[-1].with_name(AVERAGE + paths[-1].name))
    normaliser, networks = jax.eval_shape(lambda key: untrained(networks_of(recipe), key), jax.random.PRNGKey(0))
    template = (normaliser, networks.policy, networks.value)
    found = []
    seed = (HELD_OUT_SEED, standing.seed)
    with hands_to_measure(stage, settings, seed, HELD_OUT, threads=threads) as hands:
        for path in paths:
            steps = int(path.stem.rpartition("_")[2])
            about = {**provenance, "steps": steps, "averaged": path.name.startswith(AVERAGE)}
            policy = deployable(recipe.name, task, load_arrays(path, template), about)
            made = run(policy, task, hands, EPISODE_S, seed=HELD_OUT_SEED)
            bound = lower_bound(recipe.goal, made.rate_rad_s, made.kept)
            found.append(Candidate(path.stem, policy, float(made.kept.mean()), float(made.rate_rad_s.mean()), bound))
            on_candidate(found[-1])
    return sorted(found, key=lambda one: one.bound_rad_s, reverse=True)
