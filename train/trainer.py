"""A training run: the stages of a recipe one after another, saved so that no ending loses what was done."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from enum import Enum
from math import exp, nan
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np

from aero.policy.file import Policy, save
from aero.safety.interrupts import noted
from train import randomise
from train.environment import (
    STARTS,
    Advance,
    CubeEnvironment,
    EnvironmentState,
    Prices,
    native,
    over_mjx,
    prepare_starts,
)
from train.evaluation import rollouts
from train.hand_stock import HandStock, draw_routed, hands_to_measure, oldest, present
from train.ppo import Learner, NetworkParameters, Ppo, averaged, batched, deployable
from train.recipe import Recipe
from train.run_state import (
    AVERAGE,
    CHECKPOINTS,
    STATE,
    Checkpoint,
    RunFolderError,
    Standing,
    append,
    load_arrays,
    read_standing,
    save_arrays,
)
from train.simulator import Simulator, StopCheck, build_scene
from train.task import SENSOR_COUNT

# A callback into MuJoCo would wait for the thread that it blocks. Holds only if set before JAX makes its CPU client.
jax.config.update("jax_cpu_enable_async_dispatch", False)

Backend = Literal["native", "mjx"]
STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that end a run."""
EPISODE_S = 15.0
"""Length of the episodes that a checkpoint is measured over, as the paper's figures."""
EPOCH_STEPS = 20_000
"""Environment steps, rounded to whole updates, after which the run's state is written and reported."""
_TRAINED, _MEASURED, _NETWORKS, _ENVIRONMENT, _UPDATES, _RENEWED = range(6)
"""Streams of random numbers of a stage."""


class StopReason(Enum):
    """Why a run ended."""

    DONE = "the recipe is done"
    TIME = "the time is over"
    STOPPED = "it was stopped"


class _StoppedError(Exception):
    """The run is to end, between two batches of physics."""

    def __init__(self, ending: StopReason) -> None:
        super().__init__(ending.value)
        self.ending = ending


class TrainingEnd(NamedTuple):
    """How a run ended, and what it left."""

    ending: StopReason
    standing: Standing
    by_signal: int | None = None
    """Number of the signal that stopped it."""


def machine_backend() -> Backend:
    """Return `mjx` where JAX finds a GPU, else `native`."""
    return "mjx" if jax.default_backend() == "gpu" else "native"


def accelerated() -> bool:
    """Return whether JAX finds anything faster than the CPU."""
    return bool(jax.default_backend() != "cpu")


def train(
    recipe: Recipe,
    backend: Backend,
    seed: int,
    folder: Path,
    *,
    minutes: float | None = None,
    threads: int | None = None,
    resume: bool = False,
    parameters: Path | None = None,
    provenance: Mapping[str, Any] | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> TrainingEnd:
    """Train until the recipe's steps or the time are over, or a signal comes; nothing that was done is lost.

    The folder gets the curve, the parameters of every checkpoint, the best one of the stage as `<name>.npz`, and the
    state, from which a resumed run reaches the same weights as one that was never interrupted.

    Args:
        recipe: what to train.
        backend: `native` steps MuJoCo on all cores, `mjx` on the accelerator that JAX sees.
        seed: of networks, randomisation, starts and exploration.
        folder: made if missing; with `resume` the run in it is continued.
        minutes: wall time of this call; None for no bound.
        threads: of the native backend; None for all cores.
        resume: see `folder`.
        parameters: of a checkpoint, for the first stage to begin with; networks that have learned nothing when None.
        provenance: what the policy's file is to say besides recipe, seed, attempt, steps and resumes.
        say: gets a line for each epoch and checkpoint.

    Raises:
        RunFolderError: `folder` holds a run and `resume` is not asked for; or it is, and there is none, or one of
            another recipe or seed.
    """
    (folder / CHECKPOINTS).mkdir(parents=True, exist_ok=True)
    standing = _standing(recipe, seed, folder, resume)
    deadline = time.monotonic() + (60.0 * minutes if minutes else np.inf)
    with noted(*STOPPING) as signals:

        def check() -> None:
            if signals:
                raise _StoppedError(StopReason.STOPPED)
            if time.monotonic() >= deadline:
                raise _StoppedError(StopReason.TIME)

        training = _TrainingRun(
            recipe, backend, folder, threads, dict(provenance or {}), say, check, standing, parameters
        )
        ending = StopReason.DONE
        try:
            training.go(resume)
        except _StoppedError as stopped:
            ending = stopped.ending
        finally:  # what was reached is saved, whatever the ending
            training.keep()
    return TrainingEnd(ending, training.standing, signals[0] if signals else None)


def _standing(recipe: Recipe, seed: int, folder: Path, resume: bool) -> Standing:
    if not resume:
        if (folder / STATE).exists():
            raise RunFolderError(f"{folder} holds a run; resume it or choose another folder")
        return Standing(recipe.name, seed)
    standing = read_standing(folder)
    if (standing.recipe, standing.seed) != (recipe.name, seed):
        raise RunFolderError(
            f"{folder} holds recipe {standing.recipe!r} with seed {standing.seed}, not {recipe.name!r} with {seed}"
        )
    return replace(standing, resumes=standing.resumes + 1)


class Reached(NamedTuple):
    """What learning and acting have come to, a JAX pytree."""

    learner: Learner
    environment: EnvironmentState


@dataclass
class _TrainingRun:
    """A run in progress. What has been reached changes only between two updates of the networks."""

    recipe: Recipe
    backend: Backend
    folder: Path
    threads: int | None
    provenance: dict[str, Any]
    say: Callable[[str], None]
    check: StopCheck
    standing: Standing
    parameters: Path | None = None
    """Of a checkpoint, to begin with."""
    reached: Reached | None = None

    def __post_init__(self) -> None:
        self._started = time.monotonic() - self.standing.elapsed_s

    def go(self, resume: bool) -> None:
        """Go through what is left of the stages, and begin again with another seed where a run is stuck."""
        while True:
            for index in range(self.standing.stage, len(self.recipe.stages)):
                if self._finish_stage(index, resume):
                    break
                resume = False
            else:
                return

    def keep(self) -> None:
        """Write what has been reached."""
        self.standing = replace(self.standing, elapsed_s=time.monotonic() - self._started)
        if self.reached is not None:
            save_arrays(self.folder / STATE, self.reached, self.standing)

    def _finish_stage(self, index: int, resume: bool) -> bool:
        """Train to the end of a stage; return whether the run is stuck and has been set back."""
        standing = self.standing
        with StageRun(self, index, (standing.seed, standing.attempt, index)) as prepared:
            if resume:
                reached: Reached = load_arrays(self.folder / STATE, prepared.template())
                prepared.fill(standing.new_hands)
            else:
                before = self.reached.learner if self.reached else None
                if before is None and self.parameters is not None:
                    before = prepared.learner(self.parameters)
                reached = prepared.begin(before)
                price = prepared.stage.drop_price
                self.standing = standing.in_stage(index, price.begin if price else None)
            return self._learn(prepared, reached)

    def _learn(self, prepared: StageRun, reached: Reached) -> bool:
        """Update until the stage is done; return whether the run is stuck and has been set back."""
        epoch = max(1, round(EPOCH_STEPS / prepared.batch))
        checkpoint = max(1, round(self.recipe.checkpoint_steps / prepared.batch))
        last, last_steps = time.monotonic(), self.standing.steps
        paced: tuple[float, int] | None = None
        self.reached = reached
        while True:
            updates = self.standing.updates
            done = updates * prepared.batch >= prepared.stage.steps
            # Asked before an update and not after, so that a run that was ended while it measured does it again.
            if updates > self.standing.measured_at and (done or updates % checkpoint == 0):
                self._checkpoint(prepared, self.reached.learner)
                if self._stuck():
                    return True
            if done:
                return False
            self.standing, self.reached = prepared.updated(self.standing, self.reached)
            if self.standing.updates % epoch == 0:
                self.keep()
                now, steps = time.monotonic(), self.standing.steps
                steps_per_s = (steps - last_steps) / (now - last)
                last, last_steps, left_s = now, steps, None
                if paced is None:
                    paced = now, steps  # XLA compiles in a stage's first epoch, which says nothing of the next
                else:
                    left_s = max(0, self.recipe.steps - steps) * (now - paced[0]) / (steps - paced[1])
                self.say(epoch_line(prepared.stage.name, self.standing, steps_per_s, left_s))

    def _checkpoint(self, prepared: StageRun, learner: Learner) -> None:
        """Keep the parameters, measure them and their average, and write the best as the policy."""
        standing, recipe = self.standing, self.recipe
        name = f"{standing.attempt}_{standing.steps:010d}.npz"
        save_arrays(self.folder / CHECKPOINTS / name, learner.parameters)
        save_arrays(self.folder / CHECKPOINTS / (AVERAGE + name), learner.averaged_parameters)
        about = {
            "recipe": recipe.name,
            "recipe_sha256": recipe.fingerprint,
            "backend": self.backend,
            "seed": standing.seed,
            "attempt": standing.attempt,
            "steps": standing.steps,
            "resumes": standing.resumes,
            **self.provenance,
        }
        policy = prepared.policy(learner.parameters, about)
        found = prepared.measure(policy)
        average = prepared.measure(prepared.policy(learner.averaged_parameters, about))
        elapsed_s = time.monotonic() - self._started
        point = Checkpoint(
            attempt=standing.attempt,
            steps=standing.steps,
            elapsed_s=elapsed_s,
            steps_per_s=standing.steps / elapsed_s,
            rotation_rad=found["rotation_median_rad"],
            rate_rad_s=found["rate_rad_s"],
            survival=found["survival"],
            airborne=found["airborne"],
            score=recipe.goal.score(found["rate_rad_s"], found["survival"]),
            average_rate_rad_s=average["rate_rad_s"],
            average_survival=average["survival"],
            training_rate_rad_s=standing.tendency.rate_rad_s,
            hazard_per_s=standing.tendency.hazard_per_s,
            drop_price=nan if standing.drop_price is None else standing.drop_price,
            rate_error_rad_s=found["rate_error_rad_s"],
        )
        best = standing.best_score
        if best is None or point.score > best:
            save(policy, self.folder / f"{recipe.name}.npz")
            best = point.score
        self.standing = replace(
            standing,
            measured_at=standing.updates,
            best_score=best,
            best_rate_rad_s=max(standing.best_rate_rad_s, point.rate_rad_s),
        )
        append(self.folder, point)
        self.say(str(point))

    def _stuck(self) -> bool:
        """Return whether the attempt holds the cube still, and set the run back to the beginning of the next if so."""
        standing, recipe = self.standing, self.recipe
        if standing.steps < recipe.stuck_steps or standing.best_rate_rad_s >= recipe.stuck_rate_rad_s:
            return False
        self.reached = None
        self.standing = replace(Standing(standing.recipe, standing.seed), attempt=standing.attempt + 1)
        return True


def epoch_line(stage: str, standing: Standing, steps_per_s: float, left_s: float | None) -> str:
    """Return what the hands in training did lately, exploration included; costs nothing to know."""
    tendency = standing.tendency
    kept = exp(-EPISODE_S * tendency.hazard_per_s)
    price = "" if standing.drop_price is None else f" at {standing.drop_price:3.0f}"
    left = "time left not known yet" if left_s is None else f"{left_s / 60:4.0f} min left"
    return (
        f"{stage}  {standing.steps / 1e6:6.2f} M steps  {tendency.rate_rad_s:5.2f} rad/s  keeps {kept:4.0%}  "
        f"{tendency.hazard_per_s:5.2%} drops/s{price}  {steps_per_s:5.0f} steps/s  {left}"
    )


class StageRun:
    """A stage made ready: its hands, its environment, its networks, the hands that measure. A context manager."""

    def __init__(self, run: _TrainingRun, index: int, seed: tuple[int, ...]) -> None:
        self._recipe, self._threads, self._check, self._seed = run.recipe, run.threads, run.check, seed
        self.stage = stage = run.recipe.stages[index]
        self.batch = run.recipe.environments * stage.unroll
        """Environment steps an update."""
        self._task, settings = run.recipe.task_in(stage), run.recipe.task.settings
        self._kept = ExitStack()
        with ExitStack() as opened:
            self._stock = HandStock(stage, settings, (*seed, _TRAINED))
            self._simulator, advance = self._hands(run.backend, opened)
            measured = (stage, settings, (*seed, _MEASURED), stage.measured)
            self._measured = opened.enter_context(hands_to_measure(*measured, threads=run.threads, check=run.check))
            self._environment = CubeEnvironment(self._task, advance, stage.turning)
            self._ppo = Ppo(run.recipe, stage, self._environment)
            self._begin = jax.jit(lambda starts, key: self._environment.begin(starts, key, staggered=stage.staggered))
            self._renew = jax.jit(self._environment.renew)
            self._kept = opened.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._kept.close()

    def begin(self, before: Learner | None) -> Reached:
        """Return a learner that continues from the stage before, if any, and environments at their start."""
        fresh = self._ppo.begin(self._key(_NETWORKS))
        rng = np.random.default_rng((*self._seed, _ENVIRONMENT))
        starts = prepare_starts(self._task, self._simulator, rng, check=self._check)
        environment = self._begin(starts, self._key(_ENVIRONMENT))
        return Reached(self._ppo.continued(before) if before else fresh, environment)

    def learner(self, parameters: Path) -> Learner:
        """Return a learner with the parameters of a checkpoint."""
        fresh = self._ppo.begin(self._key(_NETWORKS))
        shapes = jax.eval_shape(self._ppo.begin, self._key(_NETWORKS)).parameters
        normaliser, policy, value = load_arrays(parameters, shapes)
        return fresh._replace(normaliser=normaliser, networks=fresh.networks.replace(policy=policy, value=value))

    def template(self) -> Reached:
        """Return the shapes of learner and environments."""
        count = self._recipe.environments
        states = jax.ShapeDtypeStruct((count, STARTS, self._simulator.state_size), jnp.float32)
        sensors = jax.ShapeDtypeStruct((count, STARTS, SENSOR_COUNT), jnp.float32)
        key = self._key(_NETWORKS)
        return Reached(jax.eval_shape(self._ppo.begin, key), jax.eval_shape(self._begin, (states, sensors), key))

    def fill(self, new_hands: int) -> None:
        """Put the hands into the batch that are there after `new_hands` have come."""
        numbers = present(self._recipe.environments, new_hands)
        self._put([slot for slot, number in enumerate(numbers) if number != slot], numbers)

    def updated(self, standing: Standing, reached: Reached) -> tuple[Standing, Reached]:
        """Return where a run stands after one more update of the networks.

        Nothing that goes in is changed, so that a run which is ended in the middle has still reached what it had.
        """
        stage, ppo = self.stage, self._ppo
        learner, environment = reached
        if stage.redraw and standing.updates and standing.updates % stage.redraw.every == 0:
            environment = self._renewed(environment, standing.new_hands, stage.redraw.hands)
            standing = replace(standing, new_hands=standing.new_hands + stage.redraw.hands)
        done = standing.updates * self.batch
        weights = stage.rewarded.weights
        fall = weights.fall if standing.drop_price is None else -standing.drop_price
        action_rate = stage.action_rate.at(done) if stage.action_rate else weights.action_rate
        prices = Prices(np.float32(fall), np.float32(action_rate))
        key = jax.random.fold_in(self._key(_UPDATES), standing.updates)
        steps, means = [], []
        for k in range(stage.unroll):
            self._check()
            environment, (step, *of_batch) = ppo.act(learner, environment, prices, jax.random.fold_in(key, k))
            steps.append(step)
            means.append([float(mean) for mean in of_batch])
        data = batched(steps)
        learner = ppo.observe(learner, data)
        entropy_cost = np.float32(stage.entropy_cost.at(done))
        for k in range(self._recipe.epochs):
            self._check()
            learner = ppo.learn(learner, data, jax.random.fold_in(key, stage.unroll + k), entropy_cost)
        rate_rad_s, lost = np.mean(means, axis=0).tolist()
        tendency = standing.tendency.after(rate_rad_s, lost / self._task.settings.period_s)
        price = standing.drop_price
        if stage.drop_price and price is not None:
            price = stage.drop_price.after(price, hazard_per_s=tendency.hazard_per_s, rate_rad_s=tendency.rate_rad_s)
        standing = replace(
            standing,
            steps=standing.steps + self.batch,
            updates=standing.updates + 1,
            tendency=tendency,
            drop_price=price,
        )
        return standing, Reached(averaged(learner), environment)

    def policy(self, parameters: NetworkParameters, provenance: Mapping[str, Any]) -> Policy:
        """Return parameters as a policy."""
        return deployable(self._recipe.name, self._task, parameters, provenance)

    def measure(self, policy: Policy) -> Mapping[str, float]:
        """Run an episode on each hand that the stage's checkpoints are measured on."""
        episodes = rollouts.run(policy, self._task, self._measured, EPISODE_S, seed=self._seed[0], check=self._check)
        return episodes.summary()

    def _renewed(self, environment: EnvironmentState, new_hands: int, hands: int) -> EnvironmentState:
        """Replace the oldest `hands` after `new_hands` have come, and let the new ones begin."""
        count = self._recipe.environments
        slots = oldest(count, new_hands, hands)
        self._put(slots, present(count, new_hands + hands))
        with self._simulator.part(slots, self._threads) as scenes:
            rng = np.random.default_rng((*self._seed, _RENEWED, new_hands))
            starts = prepare_starts(self._task, scenes, rng, check=self._check)
        renewed: EnvironmentState = self._renew(environment, jnp.array(slots), starts)
        return renewed

    def _put(self, slots: list[int], numbers: list[int]) -> None:
        for slot in slots:
            self._check()
            self._simulator.replace(slot, *self._stock.hand(numbers[slot]))

    def _hands(self, backend: Backend, opened: ExitStack) -> tuple[Any, Advance]:
        """Return the hands to train on, and how they move."""
        count, stage = self._recipe.environments, self.stage
        if stage.built:
            batch: Simulator = opened.enter_context(self._stock.batch(range(count), self._threads, self._check))
            return batch, native(batch)
        settings, rng = self._recipe.task.settings, np.random.default_rng((*self._seed, _TRAINED))
        model = build_scene(settings.torque_limit).compile()
        draws = draw_routed(stage, settings, rng, count, (*randomise.table(model), *stage.rows))
        batch = opened.enter_context(Simulator(randomise.models(model, draws), self._threads))
        return batch, native(batch) if backend == "native" else over_mjx(model, draws)

    def _key(self, stream: int) -> jax.Array:
        key = jax.random.PRNGKey(0)
        for number in (*self._seed, stream):
            key = jax.random.fold_in(key, number)
        return key
