"""The training scene: the routed hand with the cube, and the sensors that training reads."""

from __future__ import annotations

import mujoco

from aero.channels import Channel
from model.routed import build_routed
from model.scene import add_cube
from train.task.signals import SENSOR_COUNT

FINGERTIPS = ("index_tip", "middle_tip", "ring_tip", "pinky_tip", "thumb_tip")
"""Sites, in the order of the critic's state."""
CUBE_SENSORS = {
    "cube_position": mujoco.mjtSensor.mjSENS_FRAMEPOS,
    "cube_orientation": mujoco.mjtSensor.mjSENS_FRAMEQUAT,
    "cube_linear_velocity": mujoco.mjtSensor.mjSENS_FRAMELINVEL,
    "cube_angular_velocity": mujoco.mjtSensor.mjSENS_FRAMEANGVEL,
}


CONTACT_COUNT = SENSOR_COUNT
"""Index of the cube's contact count in the sensor vector of a scene with that sensor."""


def build_scene(*, count_contacts: bool = False) -> mujoco.MjSpec:
    """Return the right hand with the cube and every sensor of `train.task.signals`, in that order.

    Args:
        count_contacts: whether one more sensor, at `CONTACT_COUNT`, counts the contacts of the cube.
    """
    spec = build_routed("right")
    add_cube(spec)
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
    if count_contacts:
        spec.add_sensor(
            name="cube_contacts",
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_GEOM,
            objname="cube",
            intprm=(1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND), 0, 1),
        )
    return spec
