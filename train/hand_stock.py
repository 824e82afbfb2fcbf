"""Built hands of a stage, each with its cube; new hands replace the oldest.

The stage's seed and a hand's number determine everything about the hand. New hands take the slots of the oldest in
turn, so the number of redraws determines the batch, and a resumed run rebuilds an identical one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from aero.channels import CABLES
from aero.floats import Floats
from aero.policy.running import typical_correction
from aero.policy.settings import PolicySettings
from model.compiled_hand import CompiledHand
from model.units import Unit
from simulator.scene import CUBE, Cube, any_cube, nearer, tail_cube
from train import built, randomise
from train.hands import draw_hand, draw_healthy, training_correction
from train.recipe import TrainingStage
from train.simulator import Simulator, StopCheck, build_scene


class StockedHand(NamedTuple):
    """Built hand with its cube, ready for a batch."""

    scene: CompiledHand
    correction: Floats
    """Cable-length correction added to each command, (7,), m (abduction: rad)."""
    facts: Floats
    """Constants for the critic, (HAND_FACTS,), `facts_of`."""


@dataclass(frozen=True)
class HandStock:
    """Generator of a stage's hands."""

    stage: TrainingStage
    settings: PolicySettings
    seed: tuple[int, ...]
    training: bool = True
    """Whether cubes follow the stage's reach and tail share; evaluation cubes are drawn without either."""

    def hand(self, number: int) -> StockedHand:
        """Build the hand with this number."""
        rng = np.random.default_rng((*self.seed, number))
        unit = draw_healthy(rng) if self.stage.healthy else draw_hand(self.stage.hands, rng)
        cube = CUBE
        if self.stage.any_cube:
            tail = self.training and rng.uniform() < self.stage.tail_share
            cube = tail_cube(rng) if tail else any_cube(rng)
            if self.training:
                cube = nearer(cube, rng.uniform(*self.stage.cube_reach))
        scene = built.build_scene(unit, self.settings.torque_limit, cube)
        exact = training_correction(unit, self.settings)
        used = typical_correction() if self.stage.typical else exact
        error_m = self.stage.hands.correction_error_m
        correction = np.array(used)
        correction[list(CABLES)] += rng.uniform(-error_m, error_m, len(CABLES))
        return StockedHand(scene, correction, facts_of(unit, cube, correction - exact))

    def batch(
        self, numbers: Sequence[int], threads: int | None = None, check: StopCheck = lambda: None
    ) -> built.BuiltSimulator:
        """Build the hands with these numbers as one batch."""
        made = []
        for number in numbers:
            check()
            made.append(self.hand(number))
        batch = built.BuiltSimulator([one.scene for one in made], np.array([one.correction for one in made]), threads)
        batch.facts = np.array([one.facts for one in made])
        return batch


def facts_of(unit: Unit, cube: Cube, error: Floats) -> Floats:
    """Return what the critic knows of a hand and its cube, (HAND_FACTS,): SI units.

    Side, mass, friction and centre of mass of the cube; friction, patch and compliance of the pads; the error of the
    correction of each cable, from `error` (7,).
    """
    of_cube = (cube.side_m, cube.mass_kg, cube.friction, *cube.centre_of_mass_m)
    return np.array(
        (*of_cube, unit.hand.pad_friction, unit.hand.pad_patch, unit.hand.pad_compliance, *error[list(CABLES)])
    )


def present(count: int, new: int) -> list[int]:
    """Return the hand number of each of `count` slots after `new` arrivals, which fill the slots in turn."""
    return [slot + count * -(-(new - slot) // count) if new > slot else slot for slot in range(count)]


def next_slots(count: int, new: int, hands: int) -> list[int]:
    """Return the slots of the next `hands` arrivals (oldest first); `new` have arrived before."""
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
    """Return a batch of `count` evaluation hands drawn from the seed; the caller closes it."""
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
    """Draw the randomised fields of a stage's routed hands, cubes included."""
    limit, cubes = settings.torque_limit, None
    if stage.any_cube:
        cubes = randomise.cube_draws([build_scene(limit, any_cube(rng)).compile() for _ in range(count)])
    return randomise.draw(build_scene(limit).compile(), rng, count, rows, cubes)
