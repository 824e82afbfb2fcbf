"""Train a policy: Brax PPO over either backend in stages, the best checkpoint by the goal, restarts when stuck."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import jax
import mujoco
import numpy as np
from brax.training.agents.ppo import networks as ppo_networks
from brax.training.agents.ppo import train as brax_ppo

from aero.policy.file import Policy, load, save
from model.cubes import any_cube
from train import export, randomise
from train.built import BuiltSimulator, MixedSimulator, draw_scenes
from train.environment import CubeEnvironment, prepare_starts
from train.evaluation.rollouts import Episodes, run
from train.hands import corrections, draw_hand
from train.physics import native, over_mjx
from train.progress import PARAMETERS, Checkpoint, Standing, append, read_standing, write_standing
from train.randomise import Row
from train.recipe import Goal, Recipe, Stage
from train.scene import build_scene
from train.simulator import Simulator

# A callback into MuJoCo would wait for the thread that it blocks. Holds only if set before JAX makes its CPU client.
jax.config.update("jax_cpu_enable_async_dispatch", False)

Backend = Literal["native", "mjx"]
OnCheckpoint = Callable[[Checkpoint], None]

EPISODE_S = 15.0
"""Length of the episodes that a checkpoint is measured over, as the paper's figures."""


class _StuckError(Exception):
    """The run holds the cube still."""


class _TimeOverError(Exception):
    """The time that was given is over."""


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
    on_checkpoint: OnCheckpoint = lambda _: None,
) -> Policy:
    """Train until the recipe's steps or the time are over; return the best checkpoint, which is in `folder` too.

    Args:
        recipe: what to train.
        backend: `native` steps MuJoCo on all cores, `mjx` on the accelerators JAX sees.
        seed: of networks, randomisation, starts and exploration.
        folder: gets `<name>.npz`, the curve, and what resuming needs; made if missing.
        minutes: wall time over all attempts, restarts included; None for no bound.
        threads: of the native backend; None for all cores.
        resume: go on with the run in `folder`; Adam's moments start anew.
        provenance: what the policy's file is to say besides recipe, seed, attempt, steps and resumes.
        on_checkpoint: told about every checkpoint.

    Raises:
        FileExistsError: `folder` holds a run and `resume` is not asked for.
        FileNotFoundError: `resume` is asked for and there is no run.
        ValueError: the run in `folder` is of another recipe or seed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    standing = _standing(recipe, seed, folder, resume)
    deadline = time.monotonic() - standing.elapsed_s + (60.0 * minutes if minutes else np.inf)
    while True:
        attempt = _Attempt(
            recipe,
            backend,
            folder,
            standing,
            deadline=deadline,
            on_checkpoint=on_checkpoint,
            threads=threads,
            provenance=provenance or {},
        )
        try:
            attempt.run()
        except _StuckError:
            standing = replace(attempt.standing, attempt=attempt.standing.attempt + 1, stage=0, steps=0)
            write_standing(folder, standing)
            continue
        except _TimeOverError:
            pass
        break
    return load(folder / f"{recipe.name}.npz")


def judged(
    routed: Episodes,
    built: Episodes | None,
    goal: Goal,
    *,
    attempt: int,
    steps: int,
    elapsed_s: float,
    steps_per_s: float,
) -> Checkpoint:
    """Return the point of the curve for episodes on routed hands and, where a stage has them, on built ones.

    Bouncing is the routed hands' alone: built hands bounce several times as much, and would drown what the goal asks.
    """
    figures = (routed.and_then(built) if built else routed).summary()
    rate, on_routed = figures["rate_rad_s"], routed.summary()
    return Checkpoint(
        attempt=attempt,
        steps=steps,
        elapsed_s=elapsed_s,
        steps_per_s=steps_per_s,
        rotation_rad=figures["rotation_median_rad"],
        rate_rad_s=rate,
        survival=figures["survival"],
        airborne=on_routed["airborne"],
        overspeed=figures["overspeed"],
        score=goal.score(
            rate,
            survival=on_routed["survival"],
            built_survival=built.summary()["survival"] if built else 1.0,
            airborne=on_routed["airborne"],
        ),
    )


def _standing(recipe: Recipe, seed: int, folder: Path, resume: bool) -> Standing:
    if not resume:
        if (folder / PARAMETERS).exists():
            raise FileExistsError(f"{folder} holds a run; resume it or choose another folder")
        return Standing(recipe.name, seed)
    standing = read_standing(folder)
    if (standing.recipe, standing.seed) != (recipe.name, seed):
        raise ValueError(
            f"{folder} holds recipe {standing.recipe!r} with seed {standing.seed}, not {recipe.name!r} with {seed}"
        )
    return replace(standing, resumes=standing.resumes + 1)


class _Attempt:
    """One start of a run: its stages one after another, each with hands to train on and hands to be measured on."""

    def __init__(
        self,
        recipe: Recipe,
        backend: Backend,
        folder: Path,
        standing: Standing,
        *,
        deadline: float,
        on_checkpoint: OnCheckpoint,
        threads: int | None,
        provenance: Mapping[str, Any],
    ) -> None:
        self.standing = standing
        self._recipe, self._backend, self._folder = recipe, backend, folder
        self._deadline, self._on_checkpoint = deadline, on_checkpoint
        self._provided = provenance
        self._started = time.monotonic() - standing.elapsed_s
        self._processor_started = time.process_time() - standing.processor_s
        self._last_time, self._last_steps = time.monotonic(), standing.steps
        self._before = 0
        # A run that went on past the point of giving up is not stuck, however it begins after a resume.
        self._best_rate = np.inf if standing.steps >= recipe.stuck.steps else -np.inf
        self._seed = standing.seed * 1000 + standing.attempt
        # One simulator serves one device; MJX gives every device the same randomised hands, as Brax does.
        self._devices = 1 if backend == "native" else jax.local_device_count()
        self._threads = threads

    def run(self) -> None:
        """Go through what is left of the stages."""
        end = 0
        for index, stage in enumerate(self._recipe.stages):
            end += stage.steps
            if self.standing.steps < end:
                if self.standing.stage < index:
                    self.standing = replace(self.standing, stage=index, best_score=None)
                self._learn(stage, end - self.standing.steps)

    def _learn(self, stage: Stage, steps: int) -> None:
        """Train for `steps` on hands that are drawn for this stage."""
        recipe = self._recipe
        self._before, self._stage = self.standing.steps, stage
        self._task = replace(recipe.task, actuation=stage.actuation)
        rng = np.random.default_rng((self._seed, self.standing.stage))
        limit = recipe.task.settings.torque_limit
        model = build_scene(limit).compile()

        def drawn(count: int, *rows: Row) -> randomise.Draws:
            if not stage.any_cube:
                return randomise.draw(model, rng, count, rows)
            cubes = [build_scene(limit, any_cube(rng)).compile() for _ in range(count)]
            return randomise.draw(model, rng, count, rows, randomise.cube_draws(cubes))

        paper = randomise.table(model, recipe.tip_friction)
        draws = drawn(recipe.environments // self._devices, *paper, *stage.rows)
        measured = drawn(stage.measured, *stage.rows)
        hands = randomise.models(model, measured) if measured else [model] * stage.measured
        with ExitStack() as stack:
            routed, built = self._batches(stage, randomise.models(model, draws), rng, stack)
            self._measured = self._batches(stage, hands, rng, stack)
            batch = MixedSimulator(routed, built) if built else routed
            starts = prepare_starts(recipe.task, batch, rng)
            advance = native(batch) if self._backend == "native" else over_mjx(model, draws)
            task = recipe.task_in(stage, recipe.environments)
            self._optimise(stage, steps, CubeEnvironment(task, advance, starts, self._backend))

    def _batches(
        self, stage: Stage, models: list[mujoco.MjModel], rng: np.random.Generator, stack: ExitStack
    ) -> tuple[Simulator, BuiltSimulator | None]:
        """Return the routed hands, and the stage's share of built ones, which take the place of the last."""
        built = stage.built_hands(len(models))
        routed = stack.enter_context(Simulator(models[: len(models) - built], self._threads))
        if not built:
            return routed, None
        settings, threads = self._recipe.task.settings, self._threads
        units = [draw_hand(stage.hands, rng) for _ in range(built)]
        cubes = [any_cube(rng) for _ in units] if stage.any_cube else None
        scenes = draw_scenes(units, stage.hands, rng, settings.torque_limit, cubes)
        corrected = corrections(units, settings, rng, error_m=stage.hands.correction_error_m, threads=threads)
        return routed, stack.enter_context(BuiltSimulator(scenes, corrected, threads))

    def _optimise(self, stage: Stage, steps: int, environment: CubeEnvironment) -> None:
        recipe = self._recipe
        learn = partial(
            brax_ppo.train,
            environment=environment,
            max_devices_per_host=self._devices,
            wrap_env=False,
            num_envs=recipe.environments,
            episode_length=recipe.task.episode_steps,
            learning_rate=stage.learning_rate,
            entropy_cost=stage.entropy_cost,
            discounting=stage.discount,
            unroll_length=recipe.unroll,
            batch_size=recipe.environments // recipe.minibatches,
            num_minibatches=recipe.minibatches,
            num_updates_per_batch=recipe.epochs,
            normalize_observations=True,
            clipping_epsilon=recipe.clipping,
            gae_lambda=recipe.gae,
            network_factory=partial(
                ppo_networks.make_ppo_networks,
                policy_hidden_layer_sizes=recipe.hidden,
                value_hidden_layer_sizes=recipe.hidden,
                value_obs_key="privileged_state",
            ),
            seed=self._seed + self._before,
            run_evals=False,
        )
        parameters = None
        if self._before:
            _, template, _ = learn(num_timesteps=0)
            parameters = export.load_parameters(template, self._folder / PARAMETERS)
        learn(
            num_timesteps=steps,
            num_evals=1 + -(-steps // recipe.checkpoint_steps),
            policy_params_fn=self._checkpoint,
            restore_params=parameters,
        )

    def _checkpoint(self, steps: int, _: Any, parameters: export.Parameters) -> None:
        """Measure, write and judge the policy after `steps` of this stage; Brax calls this."""
        if self._before and not steps:
            return  # measured already, at the end of what came before
        recipe = self._recipe
        now, done = time.monotonic(), self._before + steps
        speed = (done - self._last_steps) / (now - self._last_time)
        policy = export.policy(recipe.name, self._task, parameters, self._provenance(done))
        point = judged(
            *self._measure(policy),
            recipe.goal,
            attempt=self.standing.attempt,
            steps=done,
            elapsed_s=time.monotonic() - self._started,
            steps_per_s=speed,
        )
        best = self.standing.best_score
        if best is None or point.score > best:
            save(policy, self._folder / f"{recipe.name}.npz")
            best = point.score
        self.standing = replace(
            self.standing,
            steps=done,
            elapsed_s=point.elapsed_s,
            processor_s=time.process_time() - self._processor_started,
            best_score=best,
        )
        export.save_parameters(parameters, self._folder / PARAMETERS)
        write_standing(self._folder, self.standing)
        append(self._folder, point)
        self._on_checkpoint(point)
        self._best_rate = max(self._best_rate, point.rate_rad_s)
        self._last_time, self._last_steps = time.monotonic(), done
        if time.monotonic() >= self._deadline:
            raise _TimeOverError
        if done >= recipe.stuck.steps and self._best_rate < recipe.stuck.rate_rad_s:
            raise _StuckError

    def _measure(self, policy: Policy) -> tuple[Episodes, Episodes | None]:
        """Run an episode on each routed and each built hand that the stage's checkpoints are measured on."""
        task, routed_actuation = self._task, self._stage.routed_measured or self._stage.actuation
        routed, built = self._measured
        return (
            run(policy, replace(task, actuation=routed_actuation), routed, EPISODE_S, seed=self._seed),
            run(policy, task, built, EPISODE_S, seed=self._seed) if built else None,
        )

    def _provenance(self, steps: int) -> dict[str, Any]:
        return {
            "recipe": self._recipe.name,
            "recipe_sha256": self._recipe.fingerprint,
            "backend": self._backend,
            "seed": self.standing.seed,
            "attempt": self.standing.attempt,
            "steps": steps,
            "resumes": self.standing.resumes,
            **self._provided,
        }
