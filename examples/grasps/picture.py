"""All grasps in one picture, each as it was when the person had let go. Needs OpenGL, see `simulator.pictures`."""

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from aero.channels import Joint
from simulator import build_routed
from simulator.scene import add_light

from .grasp import Grasp
from .object_plant import add_object
from .trial import Result

TILE = 330
"""Pixels drawn across a tile, and down; the picture shows fewer."""
COLUMNS, ROWS = 7, 5
LOOKED_AT, DISTANCE, AZIMUTH, ELEVATION = (0.135, 0.0, -0.04), 0.24, 140.0, -35.0
"""World frame, m; and of the camera m and degrees, as MuJoCo counts them."""
WIDTH_PX, DPI, JPEG_QUALITY = 1540, 110, 82
COLOURS = {True: "#2a7f3f", False: "#b3261e"}
"""Of the words over a tile: held or not."""


def tile(grasp: Grasp, pose: Sequence[float]) -> NDArray[np.uint8]:
    """Draw one grasp.

    Args:
        grasp: whose object it is.
        pose: joint angles, (16,) rad, and object, (7,), m and w x y z; as `Result.pose`.

    Returns:
        (TILE, TILE, 3) RGB.
    """
    spec = build_routed()
    add_object(spec, grasp.thing, pose[16:19], pose[19:23])
    add_light(spec)
    spec.visual.global_.offwidth = spec.visual.global_.offheight = TILE
    model = spec.compile()
    data = mujoco.MjData(model)
    for joint in Joint:
        data.joint(joint.label).qpos = pose[joint]
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = LOOKED_AT
    camera.distance, camera.azimuth, camera.elevation = DISTANCE, AZIMUTH, ELEVATION
    with mujoco.Renderer(model, TILE, TILE) as renderer:
        renderer.update_scene(data, camera)
        rgb: NDArray[np.uint8] = renderer.render()
    return rgb


def write_contact_sheet(grasps: Sequence[Grasp], results: Sequence[Result], path: Path) -> None:
    """Write a JPEG file with a tile for each grasp and its result; the words are red over those that fail."""
    height_px = WIDTH_PX * ROWS / COLUMNS * 1.12
    figure = Figure(figsize=(WIDTH_PX / DPI, height_px / DPI), dpi=DPI, layout="constrained")
    places = figure.subplots(ROWS, COLUMNS).ravel()
    for place in places:
        place.set_axis_off()
    for place, grasp, result in zip(places, grasps, results, strict=False):
        place.imshow(tile(grasp, result.pose))
        place.set_title(f"{grasp.number} {grasp.name}", fontsize=12, color=COLOURS[result.held])
    figure.savefig(path, format="jpeg", pil_kwargs={"quality": JPEG_QUALITY})
