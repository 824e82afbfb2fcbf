"""The training scene: the routed hand with the cube, and the sensors that training reads."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from model.routed import build_routed
from model.scene import CUBE, Cube, add_cube
from train.actuation import STALL_FORCE

FINGERTIPS = ("index_tip", "middle_tip", "ring_tip", "pinky_tip", "thumb_tip")
"""Sites, in the order of the critic's state."""
CUBE_SENSORS = {
    "cube_position": mujoco.mjtSensor.mjSENS_FRAMEPOS,
    "cube_orientation": mujoco.mjtSensor.mjSENS_FRAMEQUAT,
    "cube_linear_velocity": mujoco.mjtSensor.mjSENS_FRAMELINVEL,
    "cube_angular_velocity": mujoco.mjtSensor.mjSENS_FRAMEANGVEL,
}


def build_scene(torque_limit: float | None = None, cube: Cube = CUBE) -> mujoco.MjSpec:
    """Return the right hand with the cube and every sensor of `train.task`, in that order.

    Args:
        torque_limit: share of the servos' stall torque that the actuators may use; None leaves them without a bound,
            as the released model.
        cube: what is turned.
    """
    spec = build_routed("right")
    # A simple body's inertia and centre of mass are fixed when it is compiled; `train.randomise` draws both later.
    add_cube(spec, cube).simple = 0
    if torque_limit is not None:
        for channel, force in zip(Channel, torque_limit * STALL_FORCE, strict=True):
            spec.actuator(channel.label).forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
            spec.actuator(channel.label).forcerange = (-force, force)
    add_sensors(spec)
    return spec


def add_sensors(spec: mujoco.MjSpec) -> None:
    """Add the sensors of `train.task` behind the lengths: forces, fingertips and cube of any hand."""
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
    """Return the geoms of the fingertips that can touch something."""
    tips = np.array([model.site(tip).bodyid[0] for tip in FINGERTIPS])
    return np.flatnonzero(np.isin(model.geom_bodyid, tips) & (model.geom_contype != 0))
