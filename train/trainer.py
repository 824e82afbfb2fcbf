"""Training run: the stages of a recipe in order, saved so that no ending loses progress."""

from __future__ import annotations

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

from aero.exit_code import STOPPING
from aero.policy.file import Policy, load, save
from aero.regular_file import read_npz
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
from train.hand_stock import HandStock, draw_routed, hands_to_measure, next_slots, present
from train.ppo import Learner, NetworkParameters, Ppo, averaged, batched, deployable, fresh_critic
from train.recipe import Recipe
from train.run_state import (
    AVERAGE,
    CHECKPOINTS,
    LARGEST_BYTES,
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
from train.task import HAND_FACTS, SENSOR_COUNT

# A callback into MuJoCo would wait for the thread that it blocks. Effective only before JAX creates its CPU client.
jax.config.update("jax_cpu_enable_async_dispatch", False)

Backend = Literal["native", "mjx"]
EPISODE_S = 15.0
"""Episode length of a checkpoint's measurement, s; as for the paper's figures."""
POLICY_HEADER = "header"
"""Array in a policy file that a checkpoint lacks."""
EPOCH_STEPS = 20_000
"""Environment steps, rounded to whole updates, between two saves and reports of the run's state."""
_TRAINED, _MEASURED, _NETWORKS, _ENVIRONMENT, _UPDATES, _RENEWED = range(6)
"""Random streams of a stage."""


class StopReason(Enum):
    """Reason for the end of a run."""

    DONE = "the recipe is done"
    TIME = "the time is over"
    STOPPED = "it was stopped"


class _StoppedError(Exception):
    """Request to end the run, raised between two batches of physics."""

    def __init__(self, ending: StopReason) -> None:
        super().__init__(ending.value)
        self.ending = ending


class TrainingEnd(NamedTuple):
    """Result of a training run: stop reason and final state."""

    ending: StopReason
    standing: Standing
    by_signal: int | None = None
    """Number of the signal that stopped the run, or None."""


def machine_backend() -> Backend:
    """Return `mjx` if JAX finds a GPU, else `native`."""
    return "mjx" if jax.default_backend() == "gpu" else "native"


def accelerated() -> bool:
    """Return whether JAX finds a device faster than the CPU."""
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
    """Train until the recipe's steps or the time run out, or a signal arrives; no ending loses progress.

    The folder contains the curve, the parameters of every checkpoint, the stage's best one as `<name>.npz`, and the
    state. A run resumed from this state reaches the weights of an uninterrupted run.

    Args:
        recipe: recipe to train.
        backend: `native` steps MuJoCo on all cores, `mjx` on JAX's accelerator.
        seed: seed of networks, randomisation, starts and exploration.
        folder: folder of the run, created if missing.
        minutes: limit of this call's wall time; None for no limit.
        threads: number of threads of the native backend; None for all cores.
        resume: True to continue the run in `folder`.
        parameters: checkpoint with the first stage's initial parameters; None for untrained networks.
        provenance: entries of the policy's file besides recipe, seed, attempt, steps and resumes.
        say: called with a line for each epoch and checkpoint.

    Raises:
        RunFolderError: without `resume`, `folder` contains a run; with `resume`, it contains no run, or a run of
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
        finally:  # save the progress, whatever the ending
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
    """Learner and environments at one update, a JAX pytree."""

    learner: Learner
    environment: EnvironmentState


@dataclass
class _TrainingRun:
    """Run in progress; its state changes only between two updates of the networks."""

    recipe: Recipe
    backend: Backend
    folder: Path
    threads: int | None
    provenance: dict[str, Any]
    say: Callable[[str], None]
    check: StopCheck
    standing: Standing
    parameters: Path | None = None
    reached: Reached | None = None

    def __post_init__(self) -> None:
        self._started = time.monotonic() - self.standing.elapsed_s

    def go(self, resume: bool) -> None:
        """Train the remaining stages; restart with another seed if the run is stuck."""
        while True:
            for index in range(self.standing.stage, len(self.recipe.stages)):
                if self._finish_stage(index, resume):
                    break
                resume = False
            else:
                return

    def keep(self) -> None:
        """Write the current state to the run's folder."""
        self.standing = replace(self.standing, elapsed_s=time.monotonic() - self._started)
        if self.reached is not None:
            save_arrays(self.folder / STATE, self.reached, self.standing)

    def _finish_stage(self, index: int, resume: bool) -> bool:
        """Train to the end of a stage; return whether the run was stuck and has been reset."""
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
        """Update until the stage is done; return whether the run was stuck and has been reset."""
        epoch = max(1, round(EPOCH_STEPS / prepared.batch))
        checkpoint = max(1, round(self.recipe.checkpoint_steps / prepared.batch))
        last, last_steps = time.monotonic(), self.standing.steps
        paced: tuple[float, int] | None = None
        self.reached = reached
        while True:
            updates = self.standing.updates
            done = updates * prepared.batch >= prepared.stage.steps
            # Measure before an update, not after, so that a run interrupted during a measurement repeats it on
            # resuming.
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
                    paced = now, steps  # the first epoch of a stage includes XLA's compilation
                else:
                    left_s = max(0, self.recipe.steps - steps) * (now - paced[0]) / (steps - paced[1])
                self.say(epoch_line(prepared.stage.name, self.standing, steps_per_s, left_s))

    def _checkpoint(self, prepared: StageRun, learner: Learner) -> None:
        """Save the parameters, measure them and their average, and write the best as the policy."""
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
        """Return whether the attempt does not turn the cube; if so, reset the run to the start of the next attempt."""
        standing, recipe = self.standing, self.recipe
        if standing.steps < recipe.stuck_steps or standing.best_rate_rad_s >= recipe.stuck_rate_rad_s:
            return False
        self.reached = None
        self.standing = replace(Standing(standing.recipe, standing.seed), attempt=standing.attempt + 1)
        return True


def epoch_line(stage: str, standing: Standing, steps_per_s: float, left_s: float | None) -> str:
    """Return the report line of an epoch, from running means of training (exploration included)."""
    tendency = standing.tendency
    kept = exp(-EPISODE_S * tendency.hazard_per_s)
    price = "" if standing.drop_price is None else f" at {standing.drop_price:3.0f}"
    left = "time left not known yet" if left_s is None else f"{left_s / 60:4.0f} min left"
    return (
        f"{stage}  {standing.steps / 1e6:6.2f} M steps  {tendency.rate_rad_s:5.2f} rad/s  keeps {kept:4.0%}  "
        f"{tendency.hazard_per_s:5.2%} drops/s{price}  {steps_per_s:5.0f} steps/s  {left}"
    )


class StageRun:
    """Context manager that builds one stage: training hands, environment, networks, evaluation hands."""

    def __init__(self, run: _TrainingRun, index: int, seed: tuple[int, ...]) -> None:
        self._recipe, self._threads, self._check, self._seed = run.recipe, run.threads, run.check, seed
        self.stage = stage = run.recipe.stages[index]
        self.batch = run.recipe.environments * stage.unroll
        self._task, settings = run.recipe.task_in(stage), run.recipe.task.settings
        self._kept = ExitStack()
        with ExitStack() as opened:
            self._stock = HandStock(stage, settings, (*seed, _TRAINED))
            self._simulator, advance = self._hands(run.backend, opened)
            measured = (stage, settings, (*seed, _MEASURED), stage.measured)
            self._measured = opened.enter_context(hands_to_measure(*measured, threads=run.threads, check=run.check))
            self._environment = CubeEnvironment(self._task, advance, stage.turning, from_running=stage.from_running)
            self._ppo = Ppo(run.recipe, stage, self._environment)
            self._begin = jax.jit(lambda starts, key: self._environment.begin(starts, key, staggered=stage.staggered))
            self._renew = jax.jit(self._environment.renew)
            self._kept = opened.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._kept.close()

    def begin(self, before: Learner | None) -> Reached:
        """Return environments at their start and a learner, continued from the stage before if there is one."""
        fresh = self._ppo.begin(self._key(_NETWORKS))
        rng = np.random.default_rng((*self._seed, _ENVIRONMENT))
        starts = prepare_starts(self._task, self._simulator, rng, check=self._check)
        environment = self._begin(starts, self._key(_ENVIRONMENT))
        return Reached(self._ppo.continued(before) if before else fresh, environment)

    def learner(self, parameters: Path) -> Learner:
        """Return a learner with the parameters of a checkpoint, or with the actor of a policy file."""
        fresh = self._ppo.begin(self._key(_NETWORKS))
        if POLICY_HEADER in read_npz(parameters, LARGEST_BYTES):
            return fresh_critic(load(parameters), fresh)
        shapes = jax.eval_shape(self._ppo.begin, self._key(_NETWORKS)).parameters
        normaliser, policy, value = load_arrays(parameters, shapes)
        return fresh._replace(normaliser=normaliser, networks=fresh.networks.replace(policy=policy, value=value))

    def template(self) -> Reached:
        """Return the shapes of learner and environments."""
        count = self._recipe.environments
        states = jax.ShapeDtypeStruct((count, STARTS, self._simulator.state_size), jnp.float32)
        sensors = jax.ShapeDtypeStruct((count, STARTS, SENSOR_COUNT), jnp.float32)
        facts = jax.ShapeDtypeStruct((count, HAND_FACTS), jnp.float32)
        key, starts = self._key(_NETWORKS), (states, sensors, facts)
        return Reached(jax.eval_shape(self._ppo.begin, key), jax.eval_shape(self._begin, starts, key))

    def fill(self, new_hands: int) -> None:
        """Build the hands that are in the batch after `new_hands` arrivals."""
        numbers = present(self._recipe.environments, new_hands)
        self._put([slot for slot, number in enumerate(numbers) if number != slot], numbers)

    def updated(self, standing: Standing, reached: Reached) -> tuple[Standing, Reached]:
        """Return the run's scalar state and its arrays after one more update of the networks.

        The inputs stay unchanged, so a run that is interrupted during an update keeps its previous state.
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
        """Return the parameters as a deployable policy."""
        return deployable(self._recipe.name, self._task, parameters, provenance)

    def measure(self, policy: Policy) -> Mapping[str, float]:
        """Run an episode on each evaluation hand of the stage; return the summary figures."""
        episodes = rollouts.run(policy, self._task, self._measured, EPISODE_S, seed=self._seed[0], check=self._check)
        return episodes.summary()

    def _renewed(self, environment: EnvironmentState, new_hands: int, hands: int) -> EnvironmentState:
        """Replace the oldest `hands` after `new_hands` arrivals and start the new ones."""
        count = self._recipe.environments
        slots = next_slots(count, new_hands, hands)
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
        """Return the training hands and the function that advances them."""
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
