"""A run in progress: updates of the networks, stage after stage, and what is saved and reported of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from aero.policy.file import save
from train.environment import Prices
from train.ppo import Learner, averaged, batched, save_parameters
from train.progress import Checkpoint, Epoch, append
from train.recipe import Recipe
from train.run_state import Standing, load_arrays, save_state
from train.stage_run import Backend, Reached, StageRun, StopCheck

EPOCH_STEPS = 20_000
"""Environment steps, rounded to whole updates, after which the run's state is written and reported."""
CHECKPOINTS = "checkpoints"
"""Folder of every checkpoint's parameters."""
AVERAGE = "average_"
"""Before the name of a checkpoint's moving average."""


class Listener(NamedTuple):
    """Callbacks of a run."""

    checkpoint: Callable[[Checkpoint], None] = lambda _: None
    epoch: Callable[[Epoch], None] = lambda _: None


@dataclass(frozen=True)
class Order:
    """What is to be run, and how."""

    recipe: Recipe
    backend: Backend
    folder: Path
    threads: int | None
    """Of the native backend; None for all cores."""
    provenance: dict[str, Any]
    """What the policy's file is to say besides recipe, seed, attempt, steps and resumes."""
    listener: Listener
    check: Callable[[], None]
    """Called between two batches of physics; what it raises ends the run."""


class TrainingRun:
    """A run in progress. What has been reached changes only between two updates of the networks."""

    def __init__(self, order: Order, standing: Standing) -> None:
        self.standing = standing
        self._order, self._recipe = order, order.recipe
        self._reached: Reached | None = None
        self._pace: tuple[float, int] | None = None
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
        if self._reached is not None:
            save_state(self._order.folder, self.standing, self._reached)

    def _finish_stage(self, index: int, resume: bool) -> bool:
        """Train to the end of a stage; return whether the run is stuck and has been set back."""
        stage, standing, order = self._recipe.stages[index], self.standing, self._order
        seed = (standing.seed, standing.attempt, index)
        with StageRun(self._recipe, stage, order.backend, seed, threads=order.threads, check=order.check) as prepared:
            if resume:
                reached: Reached = load_arrays(order.folder, prepared.template())
                prepared.fill(standing.new_hands)
            else:
                reached = prepared.begin(self._reached.learner if self._reached else None)
                self.standing = standing.in_stage(index, stage.drop_price.begin if stage.drop_price else None)
            return self._learn(prepared, reached)

    def _learn(self, prepared: StageRun, reached: Reached) -> bool:
        """Update until the stage is done; return whether the run is stuck and has been set back."""
        epoch = max(1, round(EPOCH_STEPS / prepared.batch))
        checkpoint = max(1, round(self._recipe.checkpoint_steps / prepared.batch))
        last, last_steps = time.monotonic(), self.standing.steps
        self._pace = None
        self._reached = reached
        while True:
            updates = self.standing.updates
            done = updates * prepared.batch >= prepared.stage.steps
            # Asked before an update and not after, so that a run that was ended while it measured does it again.
            if updates > self.standing.measured_at and (done or updates % checkpoint == 0):
                self._checkpoint(prepared, reached.learner)
                if self._stuck():
                    return True
            if done:
                return False
            self.standing, self._reached = updated(prepared, self.standing, reached, self._order.check)
            reached = self._reached
            if self.standing.updates % epoch == 0:
                self.keep()
                now = time.monotonic()
                self._tell(prepared.stage.name, (self.standing.steps - last_steps) / (now - last))
                last, last_steps = now, self.standing.steps

    def _tell(self, stage: str, steps_per_s: float) -> None:
        standing, now, left_s = self.standing, time.monotonic(), None
        if self._pace is None:
            self._pace = now, standing.steps  # XLA compiles in a stage's first epoch, which says nothing of the next
        else:
            began, before = self._pace
            left_s = max(0, self._recipe.steps - standing.steps) * (now - began) / (standing.steps - before)
        self._order.listener.epoch(
            Epoch(
                attempt=standing.attempt,
                stage=stage,
                steps=standing.steps,
                rate_rad_s=standing.tendency.rate_rad_s,
                hazard_per_s=standing.tendency.hazard_per_s,
                drop_price=standing.drop_price,
                steps_per_s=steps_per_s,
                left_s=left_s,
            )
        )

    def _checkpoint(self, prepared: StageRun, learner: Learner) -> None:
        """Keep the parameters, measure them and their average, and write the best as the policy."""
        standing, recipe = self.standing, self._recipe
        name = f"{standing.attempt}_{standing.steps:010d}.npz"
        save_parameters(learner.parameters, self._order.folder / CHECKPOINTS / name)
        save_parameters(learner.averaged_parameters, self._order.folder / CHECKPOINTS / (AVERAGE + name))
        about = provenance(self._order, standing)
        policy = prepared.policy(learner.parameters, about)
        found = prepared.measure(policy)
        average = prepared.measure(prepared.policy(learner.averaged_parameters, about))
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
            drop_price=nan if standing.drop_price is None else standing.drop_price,
            rate_error_rad_s=found["rate_error_rad_s"],
        )
        best = standing.best_score
        if best is None or point.score > best:
            save(policy, self._order.folder / f"{recipe.name}.npz")
            best = point.score
        self.standing = replace(
            standing,
            measured_at=standing.updates,
            best_score=best,
            best_rate_rad_s=max(standing.best_rate_rad_s, point.rate_rad_s),
        )
        append(self._order.folder, point)
        self._order.listener.checkpoint(point)

    def _stuck(self) -> bool:
        """Return whether the attempt holds the cube still, and set the run back to the beginning of the next if so."""
        standing, stuck = self.standing, self._recipe.stuck
        if standing.steps < stuck.steps or standing.best_rate_rad_s >= stuck.rate_rad_s:
            return False
        self._reached = None
        self.standing = replace(Standing(standing.recipe, standing.seed), attempt=standing.attempt + 1)
        return True


def provenance(order: Order, standing: Standing) -> dict[str, Any]:
    """Return what a policy's file says of the run that made it."""
    return {
        "recipe": order.recipe.name,
        "recipe_sha256": order.recipe.fingerprint,
        "backend": order.backend,
        "seed": standing.seed,
        "attempt": standing.attempt,
        "steps": standing.steps,
        "resumes": standing.resumes,
        **order.provenance,
    }


def updated(prepared: StageRun, standing: Standing, reached: Reached, check: StopCheck) -> tuple[Standing, Reached]:
    """Return where a run stands after one more update.

    Nothing that goes in is changed, so that a run which `check` ends in the middle has still reached what it had.
    """
    stage, ppo = prepared.stage, prepared.ppo
    learner, environment = reached
    if stage.redraw and standing.updates and standing.updates % stage.redraw.every == 0:
        environment = prepared.renew(environment, standing.new_hands, stage.redraw.hands)
        standing = replace(standing, new_hands=standing.new_hands + stage.redraw.hands)
    done = standing.updates * prepared.batch
    weights = stage.rewarded.weights
    fall = weights.fall if standing.drop_price is None else -standing.drop_price
    action_rate = stage.action_rate.at(done) if stage.action_rate else weights.action_rate
    prices = Prices(np.float32(fall), np.float32(action_rate))
    key = jax.random.fold_in(prepared.key, standing.updates)
    steps, means = [], []
    for k in range(stage.unroll):
        check()
        environment, (step, *of_batch) = ppo.act(learner, environment, prices, jax.random.fold_in(key, k))
        steps.append(step)
        means.append([float(mean) for mean in of_batch])
    data = batched(steps)
    learner = ppo.observe(learner, data)
    entropy_cost = np.float32(stage.entropy_cost.at(done))
    for k in range(ppo.epochs):
        check()
        learner = ppo.learn(learner, data, jax.random.fold_in(key, stage.unroll + k), entropy_cost)
    rate_rad_s, lost = np.mean(means, axis=0).tolist()
    tendency = standing.tendency.after(rate_rad_s, lost / prepared.period_s)
    price = standing.drop_price
    if stage.drop_price and price is not None:
        price = stage.drop_price.after(price, hazard_per_s=tendency.hazard_per_s, rate_rad_s=tendency.rate_rad_s)
    standing = replace(
        standing,
        steps=standing.steps + prepared.batch,
        updates=standing.updates + 1,
        tendency=tendency,
        drop_price=price,
    )
    return standing, Reached(averaged(learner), environment)
