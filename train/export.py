"""Between Brax's PPO parameters and what this project keeps: policy files and checkpoints."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np

from aero.policy.file import Policy
from train.convert import network
from train.ppo import Learner
from train.task.episode import PHYSICS_STEP_S, Task

NetworkParameters = Any
"""Brax's (normaliser, policy, value)."""


def parameters(learner: Learner) -> NetworkParameters:
    """Return what a learner has learned."""
    return learner.normaliser, learner.networks.policy, learner.networks.value


def average(learner: Learner) -> NetworkParameters:
    """Return the same with the moving average of the policy's weights."""
    return learner.normaliser, learner.average, learner.networks.value


def policy(name: str, task: Task, parameters: NetworkParameters, provenance: Mapping[str, Any]) -> Policy:
    """Return the deployable part of PPO parameters that were trained on `task`."""
    normaliser, actor, _ = parameters
    return Policy(
        name=name,
        network=network(normaliser.mean["state"], normaliser.std["state"], actor["params"]),
        settings=task.settings,
        shown_action=task.shown_action,
        physics_rate_hz=1.0 / PHYSICS_STEP_S,
        trained_lag_s=task.actuation.lag_s,
        trained_delay_s=task.actuation.delay_s,
        provenance=dict(provenance),
    )


def save_parameters(parameters: NetworkParameters, path: Path) -> None:
    """Write PPO parameters so that `load_parameters` finds them again; an interrupted write leaves the old file."""
    leaves = jax.tree.leaves(parameters)
    partial = path.with_suffix(".partial")
    with partial.open("wb") as file:
        arrays: dict[str, Any] = {f"{i:03d}": np.asarray(leaf) for i, leaf in enumerate(leaves)}
        np.savez(file, **arrays)
    partial.replace(path)


def load_parameters(template: NetworkParameters, path: Path) -> NetworkParameters:
    """Read PPO parameters of the same structure as `template`.

    Raises:
        ValueError: the file holds other shapes, so it belongs to another recipe.
    """
    leaves, structure = jax.tree.flatten(template)
    with np.load(path, allow_pickle=False) as archive:
        stored = [archive[name] for name in sorted(archive.files)]
    if [np.shape(leaf) for leaf in leaves] != [array.shape for array in stored]:
        raise ValueError(f"{path} does not fit the recipe's networks; it belongs to another recipe")
    return jax.tree.unflatten(structure, stored)
