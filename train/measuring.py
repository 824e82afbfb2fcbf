"""Hands that a policy is measured on in process: those of a stage with evenly drawn cubes, or routed ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aero.policy.settings import PolicySettings
from model.cubes import any_cube
from train import randomise
from train.hand_stock import HandStock
from train.scene import build_scene
from train.simulator import Batch, Simulator
from train.stage import TrainingStage


def hands_to_measure(
    stage: TrainingStage,
    settings: PolicySettings,
    seed: tuple[int, ...],
    count: int,
    *,
    threads: int | None,
    check: Callable[[], None],
) -> Batch:
    """Return `count` hands that follow from the seed; whoever asks for them closes the batch."""
    if stage.built:
        return HandStock(stage, settings, seed, training=False).batch(range(count), threads, check)
    draws = draw_routed(stage, settings, np.random.default_rng(seed), count, stage.rows)
    model = build_scene(settings.torque_limit).compile()
    return Simulator(randomise.models(model, draws) if draws else [model] * count, threads)


def draw_routed(
    stage: TrainingStage,
    settings: PolicySettings,
    rng: np.random.Generator,
    count: int,
    rows: tuple[randomise.RandomRow, ...],
) -> randomise.Draws:
    """Draw what is randomised of a stage's routed hands, their cubes included."""
    limit, cubes = settings.torque_limit, None
    if stage.any_cube:
        cubes = randomise.cube_draws([build_scene(limit, any_cube(rng)).compile() for _ in range(count)])
    return randomise.draw(build_scene(limit).compile(), rng, count, rows, cubes)
