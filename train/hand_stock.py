"""The built hands of a stage, each with its cube; the oldest are replaced by new ones.

A hand has a number, and everything about it follows from the stage's seed and that number. New hands take the slots
of the oldest in turn, so the count of redraws says which hands are there: a resumed run builds the same ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from aero.policy.settings import PolicySettings
from model.compiled_hand import CompiledHand
from model.scene import CUBE, any_cube, nearer, tail_cube
from train import built, randomise
from train.hands import draw_hand, draw_healthy, training_correction
from train.recipe import TrainingStage
from train.simulator import Floats, Simulator, StopCheck, build_scene, tip_geoms


class StockedHand(NamedTuple):
    """A built hand with its cube, ready for a batch."""

    scene: CompiledHand
    correction: Floats
    """By how much longer its channels are commanded, (7,), m, abduction rad."""


@dataclass(frozen=True)
class HandStock:
    """Where the hands of a stage come from."""

    stage: TrainingStage
    settings: PolicySettings
    seed: tuple[int, ...]
    """Of the stage; hands of another seed are others."""
    training: bool = True
    """Whether cubes are nearer and from the tail as the stage says; those of hands that measure are drawn evenly."""

    def hand(self, number: int) -> StockedHand:
        """Build the hand of this number."""
        rng = np.random.default_rng((*self.seed, number))
        unit = draw_healthy(rng) if self.stage.healthy else draw_hand(self.stage.hands, rng)
        cube = CUBE
        if self.stage.any_cube:
            tail = self.training and rng.uniform() < self.stage.tail_share
            cube = tail_cube(rng) if tail else any_cube(rng)
            if self.training:
                cube = nearer(cube, rng.uniform(*self.stage.cube_reach))
        scene = built.build_scene(unit, self.settings.torque_limit, cube)
        scene.model.geom_friction[tip_geoms(scene.model), 0] = rng.uniform(*self.stage.hands.tip_friction)
        whose = None if self.stage.typical else unit
        error_m = self.stage.hands.correction_error_m
        return StockedHand(scene, training_correction(whose, self.settings, rng, error_m))

    def batch(
        self, numbers: Sequence[int], threads: int | None = None, check: StopCheck = lambda: None
    ) -> built.BuiltSimulator:
        """Build the hands of these numbers as one batch."""
        made = []
        for number in numbers:
            check()
            made.append(self.hand(number))
        return built.BuiltSimulator([one.scene for one in made], np.array([one.correction for one in made]), threads)


def present(count: int, new: int) -> list[int]:
    """Return which numbers are in the `count` slots of a batch after `new` hands have come to the first ones."""
    return [slot + count * -(-(new - slot) // count) if new > slot else slot for slot in range(count)]


def oldest(count: int, new: int, hands: int) -> list[int]:
    """Return the slots that the next `hands` new ones take, after `new` have come."""
    return [(new + k) % count for k in range(hands)]


def hands_to_measure(
    stage: TrainingStage,
    settings: PolicySettings,
    seed: tuple[int, ...],
    count: int,
    *,
    threads: int | None,
    check: StopCheck = lambda: None,
) -> Simulator:
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
