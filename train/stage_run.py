"""One stage of a run made ready: its hands, its environment, its networks, and the hands that it is measured on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import Any, Literal, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np

from aero.policy.file import Policy
from train import randomise
from train.environment import STARTS, CubeEnvironment, EnvironmentState, prepare_starts
from train.evaluation.rollouts import run
from train.hand_stock import HandStock, draw_routed, hands_to_measure, oldest, present
from train.physics import Advance, native, over_mjx
from train.ppo import Learner, NetworkParameters, Ppo, deployable
from train.recipe import Recipe
from train.scene import build_scene
from train.simulator import Batch, Simulator
from train.stage import TrainingStage
from train.task import SENSOR_COUNT

Backend = Literal["native", "mjx"]
Measure = Mapping[str, float]
StopCheck = Callable[[], None]

EPISODE_S = 15.0
"""Length of the episodes that a checkpoint is measured over, as the paper's figures."""
_TRAINED, _MEASURED, _NETWORKS, _ENVIRONMENT, _UPDATES, _RENEWED = range(6)
"""Streams of random numbers of a stage."""


class Reached(NamedTuple):
    """What learning and acting have come to, a JAX pytree."""

    learner: Learner
    environment: EnvironmentState


class StageRun:
    """A stage made ready; use as a context manager."""

    def __init__(
        self,
        recipe: Recipe,
        stage: TrainingStage,
        backend: Backend,
        seed: tuple[int, ...],
        *,
        threads: int | None,
        check: StopCheck,
    ) -> None:
        self.stage = stage
        self.batch = recipe.environments * stage.unroll
        """Environment steps an update."""
        self.period_s = recipe.task.settings.period_s
        """Length of a control period."""
        self._recipe, self._seed, self._threads, self._check = recipe, seed, threads, check
        self._task = recipe.task_in(stage)
        self._kept = ExitStack()
        with ExitStack() as opened:
            self._stock = HandStock(stage, recipe.task.settings, (*seed, _TRAINED))
            self._simulator, advance = self._hands(backend, opened)
            measured = (stage, recipe.task.settings, (*seed, _MEASURED), stage.measured)
            self._measured = opened.enter_context(hands_to_measure(*measured, threads=threads, check=check))
            self.environment = CubeEnvironment(self._task, advance, stage.turning)
            self.ppo = Ppo(recipe, stage, self.environment)
            self._begin = jax.jit(lambda starts, key: self.environment.begin(starts, key, staggered=stage.staggered))
            self._renew = jax.jit(self.environment.renew)
            self._kept = opened.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._kept.close()

    @property
    def key(self) -> jax.Array:
        """Of the stage's exploration and learning."""
        return self._key(_UPDATES)

    def begin(self, before: Learner | None) -> Reached:
        """Return a learner that continues from the stage before, if any, and environments at their start."""
        fresh = self.ppo.begin(self._key(_NETWORKS))
        rng = np.random.default_rng((*self._seed, _ENVIRONMENT))
        starts = prepare_starts(self._task, self._simulator, rng, check=self._check)
        environment = self._begin(starts, self._key(_ENVIRONMENT))
        return Reached(self.ppo.continued(before) if before else fresh, environment)

    def template(self) -> Reached:
        """Return the shapes of learner and environments."""
        count = self._recipe.environments
        states = jax.ShapeDtypeStruct((count, STARTS, self._simulator.state_size), jnp.float32)
        sensors = jax.ShapeDtypeStruct((count, STARTS, SENSOR_COUNT), jnp.float32)
        key = self._key(_NETWORKS)
        return Reached(jax.eval_shape(self.ppo.begin, key), jax.eval_shape(self._begin, (states, sensors), key))

    def fill(self, new_hands: int) -> None:
        """Put the hands into the batch that are there after `new_hands` have come."""
        numbers = present(self._recipe.environments, new_hands)
        self._put([slot for slot, number in enumerate(numbers) if number != slot], numbers)

    def renew(self, environment: EnvironmentState, new_hands: int, hands: int) -> EnvironmentState:
        """Replace the oldest `hands` after `new_hands` have come, and let the new ones begin."""
        count = self._recipe.environments
        slots = oldest(count, new_hands, hands)
        self._put(slots, present(count, new_hands + hands))
        scenes = self._simulator.part(slots, self._threads)
        with scenes:
            rng = np.random.default_rng((*self._seed, _RENEWED, new_hands))
            starts = prepare_starts(self._task, scenes, rng, check=self._check)
        renewed: EnvironmentState = self._renew(environment, jnp.array(slots), starts)
        return renewed

    def policy(self, parameters: NetworkParameters, provenance: Mapping[str, Any]) -> Policy:
        """Return parameters as a policy."""
        return deployable(self._recipe.name, self._task, parameters, provenance)

    def measure(self, policy: Policy) -> Measure:
        """Run an episode on each hand that the stage's checkpoints are measured on."""
        return run(policy, self._task, self._measured, EPISODE_S, seed=self._seed[0], check=self._check).summary()

    def _put(self, slots: list[int], numbers: list[int]) -> None:
        for slot in slots:
            self._check()
            self._simulator.replace(slot, *self._stock.hand(numbers[slot]))

    def _hands(self, backend: Backend, opened: ExitStack) -> tuple[Any, Advance]:
        """Return the hands to train on, and how they move."""
        count, stage = self._recipe.environments, self.stage
        if stage.built:
            batch: Batch = opened.enter_context(self._stock.batch(range(count), self._threads, self._check))
            return batch, native(batch)
        settings, rng = self._recipe.task.settings, np.random.default_rng((*self._seed, _TRAINED))
        model = build_scene(settings.torque_limit).compile()
        rows = (*randomise.table(model), *stage.rows)
        draws = draw_routed(stage, settings, rng, count, rows)
        batch = opened.enter_context(Simulator(randomise.models(model, draws), self._threads))
        return batch, native(batch) if backend == "native" else over_mjx(model, draws)

    def _key(self, stream: int) -> jax.Array:
        key = jax.random.PRNGKey(0)
        for number in (*self._seed, stream):
            key = jax.random.fold_in(key, number)
        return key
