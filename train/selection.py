"""Choose among the last checkpoints of a run, and the moving average of its weights, by what is asked for.

A checkpoint that was best on the hands it was chosen on is worse on others; so the choice is on hands that no
checkpoint was measured on, and by a lower confidence bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np

from aero.policy.file import Policy
from train import export
from train.evaluation.rollouts import run
from train.measuring import hands_to_measure
from train.ppo import networks_of, untrained
from train.recipe import Goal, Recipe
from train.run import AVERAGE, CHECKPOINTS
from train.run_state import Standing
from train.simulator import Floats
from train.stage_run import EPISODE_S

CANDIDATES = 8
"""Last checkpoints among which is chosen."""
HELD_OUT = 60
"""Hands that each is measured on."""
HELD_OUT_SEED = 60_000
"""Of these hands; no training has it."""
CONFIDENCE_Z = 1.645
"""One-sided 95 %."""


@dataclass(frozen=True)
class Candidate:
    """A checkpoint that might be kept."""

    name: str
    policy: Policy
    kept: float
    """Share of the hands that kept the cube."""
    rate_rad_s: float
    """Mean."""
    bound_rad_s: float
    """Lower confidence bound of what a trial is worth (`Goal.worth`)."""


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
    check: Callable[[], None] = lambda: None,
    told: Callable[[Candidate], None] = lambda _: None,
) -> list[Candidate]:
    """Return the last checkpoints of a run and its average, the best first.

    Args:
        recipe: of the run.
        folder: of the run.
        standing: where it stands; checkpoints of its attempt count.
        provenance: what the policies' files are to say besides their steps.
        threads: None for all cores.
        check: called between two batches of physics; what it raises ends the choice.
        told: about each candidate as it is measured.

    Raises:
        FileNotFoundError: there is no checkpoint.
    """
    stage = recipe.stages[standing.stage]
    task, settings = recipe.task_in(stage), recipe.task.settings
    paths = sorted((folder / CHECKPOINTS).glob(f"{standing.attempt}_*.npz"))[-CANDIDATES:]
    if not paths:
        raise FileNotFoundError(f"{folder} holds no checkpoint yet")
    paths.append(paths[-1].with_name(AVERAGE + paths[-1].name))
    normaliser, networks = jax.eval_shape(lambda key: untrained(networks_of(recipe), key), jax.random.PRNGKey(0))
    template = (normaliser, networks.policy, networks.value)
    found = []
    seed = (HELD_OUT_SEED, standing.seed)
    with hands_to_measure(stage, settings, seed, HELD_OUT, threads=threads, check=check) as hands:
        for path in paths:
            steps = int(path.stem.rpartition("_")[2])
            about = {**provenance, "steps": steps, "averaged": path.name.startswith(AVERAGE)}
            policy = export.policy(recipe.name, task, export.load_parameters(template, path), about)
            made = run(policy, task, hands, EPISODE_S, seed=HELD_OUT_SEED, check=check)
            bound = lower_bound(recipe.goal, made.rate_rad_s, made.kept)
            found.append(Candidate(path.stem, policy, float(made.kept.mean()), float(made.rate_rad_s.mean()), bound))
            told(found[-1])
    return sorted(found, key=lambda one: one.bound_rad_s, reverse=True)
