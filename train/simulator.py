"""Routed hand with the cube and all sensors of the task, as a batch in native MuJoCo.

`mujoco.rollout` steps the batch over all cores, one call per control period.
"""

import os
from collections.abc import Callable, Sequence
from typing import Self

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from aero.actuation.arrays import Array
from aero.channels import Channel
from aero.floats import Floats
from simulator.routed import build_routed
from simulator.scene import CUBE, Cube, add_cube
from train.actuation import STALL_FORCE
from train.task import HAND_FACTS, STATE_POSITIONS, STATE_VELOCITIES

StopCheck = Callable[[], None]
"""Hook between two batches of physics; an exception from it ends the work."""
STATE_KIND = mujoco.mjtState.mjSTATE_FULLPHYSICS
_POSITIONS = slice(1, 1 + STATE_POSITIONS)
_VELOCITIES = slice(1 + STATE_POSITIONS, 1 + STATE_POSITIONS + STATE_VELOCITIES)

FINGERTIPS = ("index_tip", "middle_tip", "ring_tip", "pinky_tip", "thumb_tip")
"""Fingertip sites, in the order of the critic's state."""
CUBE_SENSORS = {
    "cube_position": mujoco.mjtSensor.mjSENS_FRAMEPOS,
    "cube_orientation": mujoco.mjtSensor.mjSENS_FRAMEQUAT,
    "cube_linear_velocity": mujoco.mjtSensor.mjSENS_FRAMELINVEL,
    "cube_angular_velocity": mujoco.mjtSensor.mjSENS_FRAMEANGVEL,
}


def build_scene(torque_limit: float | None = None, cube: Cube = CUBE) -> mujoco.MjSpec:
    """Return the right hand with the cube and every sensor of `train.task`, in the task's order.

    Args:
        torque_limit: share of the servos' stall torque that the actuators may use; None leaves them without a bound,
            as the released model.
        cube: what is turned.
    """
    spec = build_routed("right")
    # MuJoCo fixes a simple body's inertia and centre of mass at compile time; `train.randomise` draws both later.
    add_cube(spec, cube).simple = 0
    if torque_limit is not None:
        for channel, force in zip(Channel, torque_limit * STALL_FORCE, strict=True):
            spec.actuator(channel.label).forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
            spec.actuator(channel.label).forcerange = (-force, force)
    add_sensors(spec)
    return spec


def add_sensors(spec: mujoco.MjSpec) -> None:
    """Add the sensors of `train.task` after the lengths: forces, fingertips and cube of any hand."""
    for channel in Channel:
        spec.add_sensor(
            name=f"{channel.label}_force",
            type=mujoco.mjtSensor.mjSENS_ACTUATORFRC,
            objtype=mujoco.mjtObj.mjOBJ_ACTUATOR,
            objname=channel.label,
        )
    for tip in FINGERTIPS:
        spec.add_sensor(
            name=f"{tip}_position",
            type=mujoco.mjtSensor.mjSENS_FRAMEPOS,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=tip,
            reftype=mujoco.mjtObj.mjOBJ_XBODY,
            refname="palm",
        )
    for name, kind in CUBE_SENSORS.items():
        spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_BODY, objname="cube")
    spec.add_sensor(
        name="cube_contacts",
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=mujoco.mjtObj.mjOBJ_GEOM,
        objname="cube",
        intprm=(1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND), 0, 1),
    )


def tip_geoms(model: mujoco.MjModel) -> NDArray[np.int_]:
    """Return the fingertip geoms that can collide."""
    tips = np.array([model.site(tip).bodyid[0] for tip in FINGERTIPS])
    return np.flatnonzero(np.isin(model.geom_bodyid, tips) & (model.geom_contype != 0))


class Simulator:
    """Batch of training scenes, one model each, over a thread pool; stateless between calls.

    Use it as a context manager. A state is (time, positions (23), velocities (22)).
    """

    def __init__(self, models: Sequence[mujoco.MjModel], threads: int | None = None) -> None:
        """Create a batch of `len(models)` scenes on `threads` threads (default: all cores)."""
        self.models = list(models)
        self.state_size = mujoco.mj_stateSize(self.models[0], STATE_KIND)
        self.facts = np.zeros((len(self.models), HAND_FACTS))
        """Constants of each scene for the critic, (batch, HAND_FACTS); zero unless the scenes are drawn hands."""
        threads = threads or os.cpu_count() or 1
        self._data = [mujoco.MjData(self.models[0]) for _ in range(threads)]
        self._pool = rollout.Rollout(nthread=threads)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.close()

    def __len__(self) -> int:
        return len(self.models)

    def advance(self, states: Floats, controls: Floats) -> tuple[Floats, Floats]:
        """Step every scene.

        Args:
            states: (batch, state_size).
            controls: (batch, steps, 7), m, abduction rad; MuJoCo clamps them to the actuator ranges.

        Returns:
            The states after the last step, (batch, state_size), and the sensors of every step, (batch, steps, 43).
        """
        trajectory, sensors = self._pool.rollout(self.models, self._data, states, controls)
        return trajectory[:, -1], sensors

    def at(self, starts: Floats) -> Floats:
        """Return states at rest at `starts` (batch, 23)."""
        states = np.zeros((len(self), self.state_size))
        states[:, _POSITIONS] = starts
        return states

    def sensors_at(self, starts: Floats, control: Floats) -> Floats:
        """Return the sensors at rest at `starts` (batch, 23) under `control` (7,), (batch, 43)."""
        controls = np.broadcast_to(control, (len(self), 1, len(control)))
        return self.advance(self.at(starts), controls)[1][:, 0]


def positions(states: Array) -> Array:
    """Return the generalised positions in `states`, (..., 23)."""
    return states[..., _POSITIONS]


def velocities(states: Array) -> Array:
    """Return the generalised velocities in `states`, (..., 22)."""
    return states[..., _VELOCITIES]
