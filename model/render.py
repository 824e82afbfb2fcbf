"""Pictures of a hand. Needs an OpenGL context; on a machine without display set `MUJOCO_GL=egl`."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
from matplotlib import image
from numpy.typing import ArrayLike, NDArray

from aero.channels import Joint
from model.scene import add_light

WIDTH, HEIGHT = 1200, 1000
SHOWN_POSE = {Joint.THUMB_ABDUCTION: 0.5, Joint.THUMB_CMC: 0.2}
"""Joints that are not extended in a picture of the open hand, rad."""


def picture(spec: mujoco.MjSpec, joint_angles: ArrayLike | None = None) -> NDArray[np.uint8]:
    """Draw the palm side of a hand, fingers up.

    Args:
        spec: a hand; a copy of it is lit and compiled.
        joint_angles: (16,) float, rad; an open hand with its thumb forward when left out.

    Returns:
        (HEIGHT, WIDTH, 3) RGB.
    """
    lit = spec.copy()
    add_light(lit)
    lit.visual.global_.offwidth, lit.visual.global_.offheight = WIDTH, HEIGHT
    model = lit.compile()
    data = mujoco.MjData(model)
    angles = np.zeros(len(Joint)) if joint_angles is None else np.asarray(joint_angles, dtype=float)
    if joint_angles is None:
        angles[list(SHOWN_POSE)] = list(SHOWN_POSE.values())
    for joint in Joint:
        data.joint(joint.label).qpos = angles[joint]
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = 0.115, 0.0, -0.03
    camera.distance, camera.azimuth, camera.elevation = 0.30, 0.0, -80.0
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        renderer.update_scene(data, camera)
        rgb: NDArray[np.uint8] = renderer.render()
    return rgb


def write_picture(spec: mujoco.MjSpec, path: Path, joint_angles: ArrayLike | None = None) -> None:
    """Write `picture` as a PNG file."""
    image.imsave(path, picture(spec, joint_angles))
