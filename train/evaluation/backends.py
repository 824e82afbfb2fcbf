"""A policy measured in simulation, on each of the batches that training can make: condition to figures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from aero.policy.file import Policy
from aero.policy.settings import PolicySettings
from train.actuation import BUS
from train.built import BuiltSimulator, draw_scenes
from train.evaluation.conditions import conditions, delay_sweep, lag_sweep, measure
from train.evaluation.figures import delay_picture
from train.evaluation.rollouts import Episodes, run, task_of
from train.hands import HANDS, corrections, draw_hand
from train.scene import build_scene
from train.simulator import Simulator

Figures = dict[str, dict[str, float]]
"""Condition to figure to value, SI units."""


def in_plain_mujoco(
    policy: Policy,
    episodes: int,
    *,
    seconds: float,
    seed: int,
    picture: Path,
    progress: Callable[[float, str], None],
) -> Figures:
    """Measure under every condition and sweep, and draw the sweep of delays to `picture`."""
    swept = delay_sweep(policy)
    cases = [*conditions(policy), *(case for _, case in swept), *lag_sweep(policy)]
    done = iter(range(len(cases)))
    with Simulator([build_scene(policy.settings.torque_limit).compile()] * episodes) as batch:
        found = measure(
            policy, cases, batch, seconds=seconds, seed=seed,
            progress=lambda name: progress(next(done) / len(cases), name),
        )  # fmt: skip
    delay_picture([delay for delay, _ in swept], [found[case.name] for _, case in swept], picture)
    return {name: one.summary() for name, one in found.items()}


def beside_a_deployment(
    policy: Policy, settings: PolicySettings, episodes: int, *, seconds: float, seed: int
) -> dict[str, Episodes]:
    """Measure as trained, and with the `settings` of a deployment; random resets and the training's noise in both.

    From the nominal grasp without noise every episode would be the same one.
    """
    tasks = {
        "plain MuJoCo, as trained": task_of(policy),
        "plain MuJoCo, settings of the deployment": task_of(policy, replace(settings, noise=policy.settings.noise)),
    }
    with Simulator([build_scene(policy.settings.torque_limit).compile()] * episodes) as batch:
        return {name: run(policy, task, batch, seconds, seed) for name, task in tasks.items()}


def over_mjx(policy: Policy, episodes: int, *, seconds: float, seed: int) -> Figures:
    """Measure under the training conditions over MJX.

    Raises:
        ImportError: JAX is not installed.
    """
    from train.physics import MjxBatch  # noqa: PLC0415 - JAX is only needed here

    batch = MjxBatch([build_scene(policy.settings.torque_limit).compile()] * episodes)
    found = measure(policy, conditions(policy)[:1], batch, seconds=seconds, seed=seed)
    return {name: one.summary() for name, one in found.items()}


def on_built_hands(policy: Policy, episodes: int, *, seconds: float, seed: int) -> Figures:
    """Measure on built hands as training draws them, each episode on another."""
    rng = np.random.default_rng(seed)
    units = [draw_hand(HANDS, rng) for _ in range(episodes)]
    scenes = draw_scenes(units, HANDS, rng, policy.settings.torque_limit)
    corrected = corrections(units, policy.settings, rng, error_m=HANDS.correction_error_m)
    behind_the_bus = replace(task_of(policy), actuation=BUS)
    with BuiltSimulator(scenes, corrected) as batch:
        return {"as training draws them": run(policy, behind_the_bus, batch, seconds, seed).summary()}
