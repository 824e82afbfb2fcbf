"""A training run: the stages of a recipe one after another, kept so that no ending loses what was done."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Any, Literal, NamedTuple

import jax
import numpy as np

from aero.policy.file import save
from aero.safety.interrupts import noted
from train import export
from train.drop_price import Tendency
from train.environment import EnvironmentState, Prices
from train.ppo import Learner, averaged, batched
from train.progress import Checkpoint, Epoch, append
from train.recipe import Recipe
from train.run_state import STATE, Standing, load_arrays, read_standing, save_state
from train.stage_run import Backend, Measure, StageRun

# A callback into MuJoCo would wait for the thread that it blocks. Holds only if set before JAX makes its CPU client.
jax.config.update("jax_cpu_enable_async_dispatch", False)

EPOCH_STEPS = 20_000
"""Environment steps, rounded to whole updates, after which the run's state is written and told."""
CHECKPOINTS = "checkpoints"
"""Folder of every checkpoint's parameters."""


class Ending(Enum):
    """Why a run ended."""

    DONE = "the recipe is done"
    TIME = "the time is over"
    STOPPED = "it was stopped"


class _StoppedError(Exception):
    """The run is to end, between two batches of physics."""

    def __init__(self, ending: Ending) -> None:
        super().__init__(ending.value)
        self.ending = ending


class Ended(NamedTuple):
    """How a run ended, and what it left."""

    ending: Ending
    standing: Standing


class Listener(NamedTuple):
    """Who is told about a run."""

    checkpoint: Callable[[Checkpoint], None] = lambda _: None
    epoch: Callable[[Epoch], None] = lambda _: None


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
    provenance: Mapping[str, Any] | None = None,
    told: Listener = Listener(),
) -> Ended:
    """Train until the recipe's steps or the time are over, or a signal comes; nothing that was done is lost.

    The folder gets the curve, the parameters of every checkpoint, the best one of the stage as `<name>.npz`, and the
    state, from which a run that goes on reaches the same weights as one that was never broken off.

    Args:
        recipe: what to train.
        backend: `native` steps MuJoCo on all cores, `mjx` on the accelerator that JAX sees.
        seed: of networks, randomisation, starts and exploration.
        folder: made if missing.
        minutes: wall time of this call; None for no bound.
        threads: of the native backend; None for all cores.
        resume: go on with the run in `folder`.
        provenance: what the policy's file is to say besides recipe, seed, attempt, steps and resumes.
        told: about checkpoints and epochs.

    Raises:
        FileExistsError: `folder` holds a run and `resume` is not asked for.
        FileNotFoundError: `resume` is asked for and there is no run.
        ValueError: the run in `folder` is of another recipe or seed.
    """
    (folder / CHECKPOINTS).mkdir(parents=True, exist_ok=True)
    standing = _standing(recipe, seed, folder, resume)
    deadline = time.monotonic() + (60.0 * minutes if minutes else np.inf)
    with noted(*STOPPING) as heard:

        def check() -> None:
            if heard:
                raise _StoppedError(Ending.STOPPED)
            if time.monotonic() >= deadline:
                raise _StoppedError(Ending.TIME)

        run = _Run(recipe, backend, folder, standing, check, threads, provenance or {}, told)
        try:
            run.go(resume)
        except _StoppedError as stopped:
            run.keep()
            return Ended(stopped.ending, run.standing)
    return Ended(Ending.DONE, run.standing)


STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that end a run."""


def _standing(recipe: Recipe, seed: int, folder: Path, resume: bool) -> Standing:
    if not resume:
        if (folder / STATE).exists():
            raise FileExistsError(f"{folder} holds a run; resume it or choose another folder")
        return Standing(recipe.name, seed)
    standing = read_standing(folder)
    if (standing.recipe, standing.seed) != (recipe.name, seed):
        raise ValueError(
            f"{folder} holds recipe {standing.recipe!r} with seed {standing.seed}, not {recipe.name!r} with {seed}"
        )
    return replace(standing, resumes=standing.resumes + 1)


class _Run:
    """A run in progress. What has been reached changes only between two updates of the networks."""

    def __init__(
        self,
        recipe: Recipe,
        backend: Backend,
        folder: Path,
        standing: Standing,
        check: Callable[[], None],
        threads: int | None,
        provenance: Mapping[str, Any],
        told: Listener,
    ) -> None:
        self.standing = standing
        self._recipe, self._backend, self._folder, self._check = recipe, backend, folder, check
        self._threads, self._provided, self._told = threads, provenance, told
        self._learner: Learner | None = None
        self._environment: EnvironmentState | None = None
        self._started = time.monotonic() - standing.elapsed_s
        self._processor_started = time.process_time() - standing.processor_s

    def go(self, resume: bool) -> None:
        """Go through what is left of the stages, and begin again with another seed where a run is stuck."""
        while True:
            for index in range(self.standing.stage, len(self._recipe.stages)):
                if self._finish_stage(index, resume):
                    break
                resume = False
            else:
                return

    def keep(self) -> None:
        """Write what has been reached."""
        now, processor = time.monotonic(), time.process_time()
        self.standing = replace(
            self.standing, elapsed_s=now - self._started, processor_s=processor - self._processor_started
        )
        if self._learner is not None and self._environment is not None:
            save_state(self._folder, self.standing, (self._learner, self._environment))

    def _finish_stage(self, index: int, resume: bool) -> bool:
        """Train to the end of a stage; return whether the run is stuck and has been set back."""
        stage, standing = self._recipe.stages[index], self.standing
        seed = (standing.seed, standing.attempt, index)
        with StageRun(self._recipe, stage, self._backend, seed, self._threads, self._check) as run:
            if resume:
                learner, environment = load_arrays(self._folder, run.template())
                run.fill(standing.new_hands)
            else:
                learner, environment = run.begin(self._learner)
                begin = stage.drop_price.begin if stage.drop_price else -float(stage.rewarded.weights.fall)
                standing = replace(
                    standing,
                    stage=index,
                    updates=0,
                    new_hands=0,
                    drop_price=begin,
                    tendency=Tendency(),
                    best_score=None,
                )
            self.standing, self._learner, self._environment = standing, learner, environment
            left = self._left(index)
            every = max(1, round(EPOCH_STEPS / run.batch))
            measured = max(1, round(self._recipe.checkpoint_steps / run.batch))
            epoch_began, last = time.monotonic(), self.standing.steps
            while self.standing.updates * run.batch < stage.steps:
                self._update(run)
                done = self.standing.updates * run.batch >= stage.steps
                if done or self.standing.updates % measured == 0:
                    self._checkpoint(run)
                    if self._stuck():
                        return True
                if done or self.standing.updates % every == 0:
                    self.keep()
                    now = time.monotonic()
                    speed = (self.standing.steps - last) / (now - epoch_began)
                    epoch_began, last = now, self.standing.steps
                    self._tell(stage.name, speed, left - self.standing.updates * run.batch)
        return False

    def _left(self, index: int) -> int:
        """Return the steps from the beginning of a stage to the recipe's end."""
        return sum(stage.steps for stage in self._recipe.stages[index:])

    def _update(self, run: StageRun) -> None:
        """Act for an unroll and learn from it; what has been reached changes at the very end, or not at all."""
        assert self._learner is not None and self._environment is not None  # noqa: S101, PT018 - for the type checker
        standing, learner, environment = self.standing, self._learner, self._environment
        redraw = run.stage.redraw
        if redraw and standing.updates and standing.updates % redraw.every == 0:
            environment = run.renew(environment, standing.new_hands, redraw.hands)
            standing = replace(standing, new_hands=standing.new_hands + redraw.hands)
        done = standing.updates * run.batch
        weights = run.stage.rewarded.weights
        action_rate = run.stage.action_rate.at(done) if run.stage.action_rate else weights.action_rate
        prices = Prices(np.float32(-standing.drop_price), np.float32(action_rate))
        key = jax.random.fold_in(run.key, standing.updates)
        transitions, rates, losses = [], [], []
        for k in range(run.stage.unroll):
            self._check()
            environment, (transition, rate, lost) = run.ppo.act(
                learner, environment, prices, jax.random.fold_in(key, k)
            )
            transitions.append(transition)
            rates.append(float(rate))
            losses.append(float(lost))
        data = batched(transitions)
        learner = run.ppo.observe(learner, data)
        entropy_cost = np.float32(run.stage.entropy_cost.at(done))
        for k in range(self._recipe.epochs):
            self._check()
            learner = run.ppo.learn(learner, data, jax.random.fold_in(key, run.stage.unroll + k), entropy_cost)
        hazard = float(np.mean(losses)) / self._recipe.task.settings.period_s
        tendency = standing.tendency.after(float(np.mean(rates)), hazard)
        price = standing.drop_price
        if run.stage.drop_price:
            price = run.stage.drop_price.after(
                price, hazard_per_s=tendency.hazard_per_s, rate_rad_s=tendency.rate_rad_s
            )
        self.standing = replace(
            standing,
            steps=standing.steps + run.batch,
            updates=standing.updates + 1,
            tendency=tendency,
            drop_price=price,
        )
        self._learner, self._environment = averaged(learner), environment

    def _tell(self, stage: str, steps_per_s: float, left: int) -> None:
        standing = self.standing
        self._told.epoch(
            Epoch(
                attempt=standing.attempt,
                stage=stage,
                steps=standing.steps,
                rate_rad_s=standing.tendency.rate_rad_s,
                hazard_per_s=standing.tendency.hazard_per_s,
                drop_price=standing.drop_price,
                steps_per_s=steps_per_s,
                left_s=max(0, left) / steps_per_s,
            )
        )

    def _checkpoint(self, run: StageRun) -> None:
        """Keep the parameters, measure them and their average, and write the best as the policy."""
        assert self._learner is not None  # noqa: S101 - for the type checker
        standing, recipe, learner = self.standing, self._recipe, self._learner
        name = f"{standing.attempt}_{standing.steps:010d}.npz"
        export.save_parameters(export.parameters(learner), self._folder / CHECKPOINTS / name)
        export.save_parameters(export.average(learner), self._folder / CHECKPOINTS / f"average_{name}")
        policy = run.policy(export.parameters(learner), self._provenance())
        found = run.measure(policy)
        average: Measure = run.measure(run.policy(export.average(learner), self._provenance()))
        point = Checkpoint(
            attempt=standing.attempt,
            steps=standing.steps,
            elapsed_s=time.monotonic() - self._started,
            steps_per_s=standing.steps / (time.monotonic() - self._started),
            rotation_rad=found["rotation_median_rad"],
            rate_rad_s=found["rate_rad_s"],
            survival=found["survival"],
            airborne=found["airborne"],
            overspeed=found["overspeed"],
            score=recipe.goal.score(found["rate_rad_s"], found["survival"]),
            average_rate_rad_s=average["rate_rad_s"],
            average_survival=average["survival"],
            training_rate_rad_s=standing.tendency.rate_rad_s,
            hazard_per_s=standing.tendency.hazard_per_s,
            drop_price=standing.drop_price,
        )
        if standing.best_score is None or point.score > standing.best_score:
            save(policy, self._folder / f"{recipe.name}.npz")
            self.standing = replace(standing, best_score=point.score)
        self.standing = replace(self.standing, best_rate_rad_s=max(standing.best_rate_rad_s, point.rate_rad_s))
        append(self._folder, point)
        self._told.checkpoint(point)

    def _stuck(self) -> bool:
        """Return whether the attempt holds the cube still, and set the run back to the beginning of the next if so."""
        standing, stuck = self.standing, self._recipe.stuck
        if standing.steps < stuck.steps or standing.best_rate_rad_s >= stuck.rate_rad_s:
            return False
        self._learner = self._environment = None
        self.standing = replace(Standing(standing.recipe, standing.seed), attempt=standing.attempt + 1)
        return True

    def _provenance(self) -> dict[str, Any]:
        return {
            "recipe": self._recipe.name,
            "recipe_sha256": self._recipe.fingerprint,
            "backend": self._backend,
            "seed": self.standing.seed,
            "attempt": self.standing.attempt,
            "steps": self.standing.steps,
            "resumes": self.standing.resumes,
            **self._provided,
        }
