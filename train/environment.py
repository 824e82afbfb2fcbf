"""Cube task for training in JAX: a batch of hands with automatic restart, over native MuJoCo or MJX.

The solver starts cold each control period, so that both backends get identical input and policies can be exchanged
between them. Each restart draws one of the environment's prepared starts. All mutable state is in `EnvironmentState`, a
JAX pytree, so that a run can be saved and resumed bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from aero.actuation.arrays import Array
from aero.floats import Floats
from aero.policy.task import ACTION_SIZE
from train import actuation
from train.randomise import Draws
from train.simulator import Simulator, StopCheck, positions, velocities
from train.task import (
    SENSOR_COUNT,
    Episode,
    Task,
    TurningWeight,
    begin,
    command,
    critic_state,
    draw_starts,
    finish,
    observed,
    unpack,
)

Advance = Callable[[jax.Array, jax.Array], tuple[jax.Array, jax.Array]]
"""Map (batch, state) and controls (batch, steps, 7) to the final (batch, state) and sensors (batch, steps, 43)."""


def native(simulator: Simulator) -> Advance:
    """Return the step over native MuJoCo: JAX calls `mujoco.rollout`, with single precision at the interface."""

    def roll(states: jax.Array, controls: jax.Array) -> tuple[np.ndarray, np.ndarray]:
        last, sensors = simulator.advance(np.asarray(states, np.float64), np.asarray(controls, np.float64))
        return last.astype(np.float32), sensors.astype(np.float32)

    def advance(states: jax.Array, controls: jax.Array) -> tuple[jax.Array, jax.Array]:
        shapes = (
            jax.ShapeDtypeStruct(states.shape, jnp.float32),
            jax.ShapeDtypeStruct((*controls.shape[:2], SENSOR_COUNT), jnp.float32),
        )
        last, sensors = jax.pure_callback(roll, shapes, states, controls, vmap_method="broadcast_all")
        return last, sensors

    return advance


def over_mjx(model: mujoco.MjModel, draws: Draws | None = None) -> Advance:
    """Return the step over MJX.

    Args:
        model: a compiled `train.simulator`.
        draws: randomised fields, one model for each member of the batch; None gives all the same model.
    """
    from mujoco import mjx  # noqa: PLC0415 - for GPUs alone

    device = mjx.put_model(model)
    template = mjx.make_data(model)
    fields = {name: jnp.asarray(values) for name, values in (draws or {}).items()}
    positions, velocities = slice(1, 1 + model.nq), slice(1 + model.nq, 1 + model.nq + model.nv)

    def one(own: dict[str, jax.Array], state: jax.Array, controls: jax.Array) -> tuple[jax.Array, jax.Array]:
        hand = device.tree_replace(own) if own else device
        start = template.replace(time=state[0], qpos=state[positions], qvel=state[velocities])

        def step(data: mjx.Data, control: jax.Array) -> tuple[mjx.Data, jax.Array]:
            after = mjx.step(hand, data.replace(ctrl=control))
            return after, after.sensordata

        end, sensors = jax.lax.scan(step, start, controls)
        return jnp.concatenate([end.time[None], end.qpos, end.qvel]), sensors

    return lambda states, controls: jax.vmap(one)(fields, states, controls)


STARTS = 8
"""Number of prepared starts per environment."""

Starts = tuple[Array, Array, Array]
"""States (batch, starts, state size), sensors (batch, starts, 43), the hands' constants (batch, HAND_FACTS)."""

RUNNING_STEPS = (100, 2400)
"""Range of the ages of a running episode, control steps, from which another episode can start: 5 to 120 s."""
KEPT_EVERY = 200
"""Mean number of control steps between two kept states of a running episode."""


def prepare_starts(
    task: Task,
    simulator: Simulator,
    rng: np.random.Generator,
    count: int = STARTS,
    check: StopCheck = lambda: None,
) -> tuple[Floats, Floats, Floats]:
    """Return states (batch, count, state size), sensors (batch, count, 43) and constants of random starts.

    `check` is called before each batch of physics.
    """
    nominal = np.array(task.settings.nominal)
    states, sensors = [], []
    for _ in range(count):
        check()
        starts = draw_starts(rng, len(simulator), task.reset)
        states.append(simulator.at(starts))
        sensors.append(simulator.sensors_at(starts, nominal))
    return np.stack(states, axis=1), np.stack(sensors, axis=1), simulator.facts


class Prices(NamedTuple):
    """Weights of the reward that may change between updates; both are negative."""

    fall: Array
    """Weight of losing the cube."""
    action_rate: Array
    """Weight of the squared change of the action."""


class EnvironmentState(NamedTuple):
    """State of a batch of environments."""

    states: Array
    """State of the physics, (batch, state size)."""
    episode: Episode
    observation: dict[str, Array]
    """Observations: the actor's `state`, (batch, 14), and the critic's `privileged_state`, (batch, 81 + facts)."""
    age: Array
    """Control steps since the cube was placed, over all episodes from kept states, (batch,)."""
    kept: tuple[Array, Episode, dict[str, Array], Array]
    """Kept state of a running episode: physics, episode, observation and age; an age of 0 is none."""
    rate: Array
    """Running mean of each hand's rotation rate over its episodes, (batch,), rad/s."""
    starts: Starts
    key: Array


class EnvironmentStep(NamedTuple):
    """Result of a control period; each field is (batch,)."""

    reward: Array
    over: Array
    """1 if the episode ended, else 0."""
    cut: Array
    """1 if the episode ended by its length alone, else 0."""
    rotation: Array
    """Mean angular velocity about the vertical, rad/s."""
    lost: Array
    """1 if the cube was lost, else 0."""


class CubeEnvironment:
    """Batch of cube tasks; the starts and models of the advance function give its size."""

    def __init__(
        self, task: Task, advance: Advance, turning: TurningWeight | None = None, *, from_running: float = 0.0
    ) -> None:
        """Create environments.

        Args:
            task: the task.
            advance: the physics.
            turning: weight of each hand's rotation reward by its rate; None for a constant one.
            from_running: share of the episodes that continue from a kept state of a running episode.
        """
        self._task, self._advance, self._turning, self._from_running = task, advance, turning, from_running

    def begin(self, starts: Starts, key: Array, *, staggered: bool = False) -> EnvironmentState:
        """Start every environment; `staggered` episodes get random ages, so that they do not all end at once."""
        prepared: Starts = jax.tree.map(lambda array: jnp.asarray(array, jnp.float32), starts)
        key, draw, age = jax.random.split(key, 3)
        at, episode, observation = self._fresh(prepared, draw)
        if staggered:
            ages = jax.random.randint(age, episode.periods.shape, 0, self._task.episode_steps)
            episode = episode._replace(periods=ages.astype(jnp.float32))
        none = jnp.zeros(len(at))
        return EnvironmentState(at, episode, observation, none, (at, episode, observation, none), none, prepared, key)

    def renew(self, standing: EnvironmentState, slots: Array, starts: Starts) -> EnvironmentState:
        """Return the state with new hands in `slots` (count,), started at `starts`."""
        key, draw = jax.random.split(standing.key)
        prepared: Starts = jax.tree.map(
            lambda old, new: old.at[slots].set(jnp.asarray(new, jnp.float32)), standing.starts, starts
        )
        new = jnp.zeros(len(standing.rate), bool).at[slots].set(True)
        running = (standing.states, standing.episode, standing.observation)
        fresh = self._fresh(prepared, draw)
        at, episode, observation = jax.tree.map(lambda one, other: _choose(new, one, other), fresh, running)
        age, rate, kept = (jnp.where(new, 0.0, old) for old in (standing.age, standing.rate, standing.kept[3]))
        return EnvironmentState(at, episode, observation, age, (*standing.kept[:3], kept), rate, prepared, key)

    def step(
        self, standing: EnvironmentState, action: Array, prices: Prices
    ) -> tuple[EnvironmentState, EnvironmentStep]:
        """Advance every environment by one control period and restart the ended episodes."""
        key, noise_key, start_key, keep_key, again_key = jax.random.split(standing.key, 5)
        task = self._priced(standing.rate, prices)
        episode, controls = command(task, standing.episode, action)
        states, sensors = self._advance(standing.states, controls)
        noise = jax.random.uniform(noise_key, action.shape, minval=-1.0, maxval=1.0)
        episode, outcome = finish(
            task, episode, sensors, positions=positions(states), velocities=velocities(states), noise=noise
        )
        broken = ~jnp.all(jnp.isfinite(states), axis=-1)
        lost = outcome.lost | broken
        over = lost | (episode.periods >= task.episode_steps)
        rotation = jnp.where(broken, 0.0, outcome.terms["rotation"])
        step = EnvironmentStep(
            reward=jnp.where(broken, prices.fall * task.settings.period_s, outcome.reward),
            over=over.astype(jnp.float32),
            cut=(over & ~lost).astype(jnp.float32),
            rotation=rotation,
            lost=lost.astype(jnp.float32),
        )
        rate = standing.rate
        if self._turning is not None:
            rate = rate + (rotation - rate) / self._turning.memory_steps
        critic = jnp.concatenate([outcome.critic, standing.starts[2]], axis=-1)
        age = standing.age + 1
        ended = (states, episode, {"state": outcome.observation, "privileged_state": critic}, age)
        fresh = (*self._fresh(standing.starts, start_key), 0 * age)
        kept = standing.kept
        if self._from_running:
            first, last = RUNNING_STEPS
            chosen = jax.random.uniform(keep_key, age.shape) * KEPT_EVERY < 1.0
            keep = chosen & ~over & (age >= first) & (age <= last)
            kept = jax.tree.map(lambda new, old: _choose(keep, new, old), ended, kept)
            kept = (*kept[:3], jnp.where(lost, 0.0, kept[3]))  # an episode from it might begin within the loss
            again = (jax.random.uniform(again_key, age.shape) < self._from_running) & (kept[3] > 0)
            begun = (kept[0], kept[1]._replace(periods=0 * age), *kept[2:])
            fresh = jax.tree.map(lambda new, old: _choose(again, new, old), begun, fresh)
        at, episode, observation, age = jax.tree.map(lambda new, old: _choose(over, new, old), fresh, ended)
        return EnvironmentState(at, episode, observation, age, kept, rate, standing.starts, key), step

    def _priced(self, rate: Array, prices: Prices) -> Task:
        """Return the task with these prices and the rotation weight for each hand's running rate."""
        weights = self._task.rewarded.weights
        rotation = weights.rotation if self._turning is None else weights.rotation * self._turning.of(rate)
        weights = replace(weights, fall=prices.fall, action_rate=prices.action_rate, rotation=rotation)
        return replace(self._task, rewarded=replace(self._task.rewarded, weights=weights))

    def _fresh(self, starts: Starts, key: Array) -> tuple[Array, Episode, dict[str, Array]]:
        """Draw one prepared start per environment; return its state, episode and observation."""
        batch, count = starts[0].shape[:2]
        which_key, actuation_key, noise_key = jax.random.split(key, 3)
        which = jax.random.randint(which_key, (batch,), 0, count)
        states, sensors = (array[jnp.arange(batch), which] for array in starts[:2])
        episode = begin(self._task, sensors, jax.random.uniform(actuation_key, (batch, actuation.DRAWS)))
        noise = jax.random.uniform(noise_key, (batch, ACTION_SIZE), minval=-1.0, maxval=1.0)
        observation = observed(self._task, episode, noise)
        critic = critic_state(observation, positions(states), velocities(states), unpack(sensors))
        critic = jnp.concatenate([critic, starts[2]], axis=-1)
        return states, episode, {"state": observation, "privileged_state": critic}


def _choose(condition: Array, new: Array, old: Array) -> Array:
    return jnp.where(condition.reshape(condition.shape + (1,) * (new.ndim - 1)), new, old)
