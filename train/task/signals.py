"""What is sensed in an episode: names for the parts of state and sensor vectors, and the 81 values of the critic."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from aero.actuation.arrays import Array, namespace
from aero.channels import OBSERVATION_ORDER, Channel, Joint

SENSOR_SIZES = {
    "lengths": len(Channel),
    "forces": len(Channel),
    "fingertips": 5 * 3,
    "cube_position": 3,
    "cube_orientation": 4,
    "cube_linear_velocity": 3,
    "cube_angular_velocity": 3,
    "cube_contacts": 1,
}
"""Sensor blocks of a training scene in the order of its sensor vector, with their widths."""
_EDGES = np.cumsum([0, *SENSOR_SIZES.values()])
SENSOR_COUNT = int(_EDGES[-1])
_SLICES = {name: slice(a, b) for name, (a, b) in zip(SENSOR_SIZES, pairwise(_EDGES), strict=True)}
_TO_COMMAND_ORDER = np.argsort(OBSERVATION_ORDER)

GRASP_REFERENCE = np.array([0.11, 0.0, 0.0])
"""Where the critic measures the cube's position error from: the grasp site of the released model, world frame, m."""
CRITIC_SIZE = 81


class Signals(NamedTuple):
    """One step's signals; leading axes are free. Sensors lag the state by one physics step, as the released task's."""

    lengths: Array
    """Channel values, (..., 7) in command order, m, abduction rad."""
    forces: Array
    """Actuator forces, (..., 7) in command order, N, abduction N m."""
    fingertips: Array
    """Fingertip positions in the palm's frame, thumb last, (..., 15), m."""
    cube_position: Array
    """World frame, (..., 3), m."""
    cube_orientation: Array
    """Unit quaternion w x y z, (..., 4)."""
    cube_linear_velocity: Array
    """World frame, (..., 3), m/s."""
    cube_angular_velocity: Array
    """World frame, (..., 3), rad/s."""
    cube_contacts: Array
    """How many contacts the cube has, (..., 1)."""


def unpack(sensors: Array) -> Signals:
    """Name the parts of sensor vectors (..., 43)."""
    blocks = {name: sensors[..., part] for name, part in _SLICES.items()}
    return Signals(**blocks | {"lengths": blocks["lengths"][..., _TO_COMMAND_ORDER]})


def critic_state(observation: Array, positions: Array, velocities: Array, signals: Signals) -> Array:
    """Return the privileged state (paper section "Observation and action").

    Args:
        observation: the policy's observation, (..., 14).
        positions: generalised positions, (..., 23), joints first.
        velocities: generalised velocities, (..., 22), joints first.
        signals: of the same step.

    Returns:
        (..., 81): observation, joint angles and velocities, actuator forces, fingertips, cube position error,
        orientation, angular velocity, linear velocity.
    """
    joints = len(Joint)
    return namespace(observation).concatenate(
        [
            observation,
            positions[..., :joints],
            velocities[..., :joints],
            signals.forces,
            signals.fingertips,
            signals.cube_position - GRASP_REFERENCE,
            signals.cube_orientation,
            signals.cube_angular_velocity,
            signals.cube_linear_velocity,
        ],
        axis=-1,
    )
