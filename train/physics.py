"""One control period of many hands as a JAX function, over native MuJoCo or over MJX; the same state and sensors.

A state is (time, positions (23), velocities (22)) and nothing else: the solver starts cold each control period, so
that both backends see exactly the same input and policies can be exchanged between them.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx

from train.randomise import Draws
from train.simulator import Batch
from train.task import SENSOR_COUNT

Advance = Callable[[jax.Array, jax.Array], tuple[jax.Array, jax.Array]]
"""(batch, state), (batch, steps, 7) controls -> (batch, state) at the end, (batch, steps, 43) sensors."""


def native(simulator: Batch) -> Advance:
    """Return the period over native MuJoCo: JAX calls back into `mujoco.rollout`, in single precision at the border."""

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
    """Return the period over MJX.

    Args:
        model: a compiled `train.scene`.
        draws: randomised fields, one model for each member of the batch; None gives all the same model.
    """
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
