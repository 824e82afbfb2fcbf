"""The cube task as a Brax environment: a batch of hands that restart by themselves, over either backend.

Brax's own wrappers restart an episode from its first state, again and again; here each restart draws another of the
environment's prepared starts. Episode accounting is what `brax.envs.wrappers.training.EpisodeWrapper` does.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from brax.envs.base import Env, State

from aero.actuation.arrays import Array
from aero.policy.task import ACTION_SIZE, OBSERVATION_SIZE
from train import actuation
from train.physics import Advance
from train.simulator import Batch, Floats, positions, velocities
from train.task.episode import Episode, Task, begin, command, finish, observed
from train.task.grasp import draw_starts
from train.task.signals import CRITIC_SIZE, critic_state, unpack

STARTS = 16
"""Prepared starts of each environment."""


def prepare_starts(
    task: Task, simulator: Batch, rng: np.random.Generator, count: int = STARTS
) -> tuple[Floats, Floats]:
    """Return states (batch, count, 46) and sensors (batch, count, 43) of starts, drawn for each environment."""
    nominal = np.array(task.settings.nominal)
    states, sensors = [], []
    for _ in range(count):
        starts = draw_starts(rng, len(simulator), task.reset)
        states.append(simulator.at(starts))
        sensors.append(simulator.sensors_at(starts, nominal))
    return np.stack(states, axis=1), np.stack(sensors, axis=1)


class CubeEnvironment(Env):
    """A batch of cube tasks; its size is fixed by the starts, and by the advance function's models."""

    def __init__(self, task: Task, advance: Advance, starts: tuple[Floats, Floats], backend: str) -> None:
        """Make environments from `starts` (see `prepare_starts`) that move by `advance`."""
        self._task = task
        self._advance = advance
        self._start_states, self._start_sensors = (jnp.asarray(array, jnp.float32) for array in starts)
        self._backend = backend

    @property
    def observation_size(self) -> dict[str, int]:
        """Sizes of the actor's and the critic's observation."""
        return {"state": OBSERVATION_SIZE, "privileged_state": CRITIC_SIZE}

    @property
    def action_size(self) -> int:
        """Seven."""
        return ACTION_SIZE

    @property
    def backend(self) -> str:
        """`native` or `mjx`."""
        return self._backend

    def reset(self, rng: jax.Array) -> State:
        """Start every environment; `rng` is one key an environment."""
        key, draw = jax.random.split(rng[0])
        states, episode, observation = self._fresh(draw)
        zeros = jnp.zeros(len(rng))
        metrics = dict.fromkeys(("rotation", "action_rate", "fall"), zeros)
        info = {
            "steps": zeros,
            "truncation": zeros,
            "episode_done": zeros,
            "episode_metrics": {**metrics, "sum_reward": zeros, "length": zeros},
        }
        pipeline_state = {"states": states, "episode": episode, "key": key}
        return State(pipeline_state, observation, zeros, zeros, metrics, info)

    def step(self, state: State, action: jax.Array) -> State:
        """Advance every environment by one control period and restart those that ended."""
        before: dict[str, Any] = state.pipeline_state
        key, noise_key, start_key = jax.random.split(before["key"], 3)
        episode, controls = command(self._task, before["episode"], action)
        states, sensors = self._advance(before["states"], controls)
        noise = jax.random.uniform(noise_key, action.shape, minval=-1.0, maxval=1.0)
        episode, outcome = finish(
            self._task, episode, sensors, positions=positions(states), velocities=velocities(states), noise=noise
        )
        broken = ~jnp.all(jnp.isfinite(states), axis=-1)
        lost = outcome.lost | broken
        fall_reward = self._task.rewarded.weights.fall * self._task.settings.period_s
        reward = jnp.where(broken, fall_reward, outcome.reward)

        over = lost | (episode.periods >= self._task.episode_steps)
        ended_now = over.astype(jnp.float32)
        metrics = {name: jnp.where(broken, 0.0, outcome.terms[name]) for name in state.metrics}
        info = {
            "steps": episode.periods,
            "truncation": jnp.where(lost, 0.0, ended_now),
            "episode_done": ended_now,
            "episode_metrics": _accumulate(state, {**metrics, "sum_reward": reward, "length": jnp.ones_like(reward)}),
        }
        fresh = self._fresh(start_key)
        ended = (states, episode, {"state": outcome.observation, "privileged_state": outcome.critic})
        states, episode, observation = jax.tree.map(lambda new, old: _choose(over, new, old), fresh, ended)
        pipeline_state = {"states": states, "episode": episode, "key": key}
        return State(pipeline_state, observation, reward, ended_now, metrics, info)

    def _fresh(self, key: jax.Array) -> tuple[Array, Episode, dict[str, Array]]:
        """Draw one start for every environment: its state, episode and observation."""
        batch = self._start_states.shape[0]
        which_key, actuation_key, noise_key = jax.random.split(key, 3)
        which = jax.random.randint(which_key, (batch,), 0, self._start_states.shape[1])
        states = self._start_states[jnp.arange(batch), which]
        sensors = self._start_sensors[jnp.arange(batch), which]
        episode = begin(self._task, sensors, jax.random.uniform(actuation_key, (batch, actuation.DRAWS)))
        noise = jax.random.uniform(noise_key, (batch, ACTION_SIZE), minval=-1.0, maxval=1.0)
        observation = observed(self._task, episode, noise)
        critic = critic_state(observation, positions(states), velocities(states), unpack(sensors))
        return states, episode, {"state": observation, "privileged_state": critic}


def _accumulate(state: State, values: dict[str, Array]) -> dict[str, Array]:
    """Add a step's values to the sums of the running episode, which begin again after its end."""
    running = 1.0 - state.info["episode_done"]
    return {name: total * running + values[name] for name, total in state.info["episode_metrics"].items()}


def _choose(condition: Array, new: Array, old: Array) -> Array:
    return jnp.where(condition.reshape(condition.shape + (1,) * (new.ndim - 1)), new, old)
