"""The end of `aero-hil train`: the best of the last checkpoints, in process and then through every byte, is written."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from aero.policy.file import load, save
from aero.whole_file import write_whole
from hil.lab.policies.any_cube import ANY_CUBE, over_any
from hil.lab.policies.byte_evaluation import run_trials
from hil.lab.policies.cube_trial import CubeTrial
from hil.lab.policies.strata import stratum
from hil.recordings.provenance import source_commit
from train.recipe import Recipe

if TYPE_CHECKING:
    from train.run_state import Standing
    from train.selection import Candidate

FINALISTS = 2
"""Candidates that are compared through the bytes."""
CHOICE_SEED = 61_000_000
"""Seed of the first hand that they are compared on; final figures take others."""
SECONDS = 15.0
CHOICE = "choice.json"


def choose(
    recipe: Recipe,
    folder: Path,
    standing: Standing,
    *,
    units: int,
    threads: int | None,
    say: Callable[[str], None],
) -> None:
    """Write the best of the last checkpoints and their average as the run's policy.

    Args:
        recipe: of the run.
        folder: of the run; gets the policy and `choice.json`.
        standing: where the run stands.
        units: random hands with any cube on which the best two are compared through the bytes; 0 leaves that out.
        threads: None for all cores.
        say: gets a line for each figure.

    Raises:
        FileNotFoundError: there is no checkpoint yet.
    """
    from train import selection  # noqa: PLC0415 - JAX is only needed here

    def show(one: Candidate) -> None:
        say(f"  {one.name}: keeps {one.kept:.0%}, {one.rate_rad_s:.2f} rad/s, worth at least {one.bound_rad_s:.2f}")

    say(f"choosing on {selection.HELD_OUT} held-out hands in process")
    about = load(folder / f"{recipe.name}.npz").provenance  # of the training, whatever program chooses
    found = selection.ranked(recipe, folder, standing, dict(about), threads=threads, told=show)
    best, rows = found[0], [{"name": one.name, "in_process": one.bound_rad_s} for one in found]
    if units and recipe.stages[-1].built:
        say(f"comparing the best {FINALISTS} through every byte on {units} hands with any cube")
        bounds = [_bound(recipe, one, units, say) for one in found[:FINALISTS]]
        for row, bound in zip(rows, bounds, strict=False):
            row["through_bytes"] = bound
        best = found[int(np.argmax(bounds))]
    said = {
        **best.policy.provenance,
        "chosen": best.name,
        "chosen_among": len(found),
        "chosen_at_commit": source_commit(),
    }
    save(replace(best.policy, provenance=said), folder / f"{recipe.name}.npz")
    write_whole(folder / CHOICE, json.dumps({"chosen": best.name, "candidates": rows}, indent=1))
    say(f"chosen: {best.name}")


def _bound(recipe: Recipe, one: Candidate, units: int, say: Callable[[str], None]) -> float:
    from train import selection  # noqa: PLC0415 - JAX is only needed here

    made: dict[str, list[CubeTrial]] = {}
    cases = over_any(one.policy, units, seconds=SECONDS, seed=CHOICE_SEED)
    run_trials(one.policy, cases, made, lambda _done, _name: None)
    trials = made[ANY_CUBE]
    row = stratum(one.name, trials)
    rates, kept = np.array([t.rate_rad_s for t in trials]), np.array([t.kept for t in trials])
    bound = selection.lower_bound(recipe.goal, rates, kept)
    low, high = row.kept_interval
    say(
        f"  {one.name}: keeps {row.kept:.0%} ({low:.0%}-{high:.0%}), {row.rate_rad_s:.2f} rad/s, "
        f"{row.turned:.0%} above 0.1 rad/s, worth at least {bound:.2f}"
    )
    return bound
