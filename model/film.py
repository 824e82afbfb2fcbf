"""A hand that turns a cube, as pictures: the routed hand in the postures of any hand, so that its cables are drawn."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from model.appearance import Rgba
from model.geometry import Side
from model.portrait import dress_up
from model.routed import build_routed
from model.scene import CUBE, Cube, add_cube

WIDTH, HEIGHT = 480, 360
LOOKED_AT = (0.115, 0.008, 0.0)
"""World frame, m."""
DISTANCE, AZIMUTH, ELEVATION = 0.25, 155.0, -36.0
"""Place of the camera: m and degrees, as MuJoCo counts them, for a right hand; a left one is seen in the mirror."""
SHADOW_SIZE, SAMPLES = 2048, 4
"""Quality of a frame; a portrait's takes three times as long to draw."""
STICKERS: dict[tuple[int, int, int], Rgba] = {
    (1, 0, 0): (0.80, 0.15, 0.15, 1.0),
    (-1, 0, 0): (0.95, 0.55, 0.10, 1.0),
    (0, 1, 0): (0.15, 0.55, 0.25, 1.0),
    (0, -1, 0): (0.15, 0.30, 0.75, 1.0),
    (0, 0, 1): (0.95, 0.95, 0.95, 1.0),
    (0, 0, -1): (0.95, 0.85, 0.15, 1.0),
}
"""Colour on each face, by its outward direction: a turn and its direction can be seen, as on the puzzle."""
BLACK: Rgba = (0.12, 0.12, 0.13, 1.0)
"""Colour of the cube between its stickers."""
STICKER_SHARE, STICKER_THICKNESS = 0.8, 0.2e-3
"""Share of a face's width; m."""


def frames(positions: NDArray[np.float64], side: Side = "right", cube: Cube = CUBE) -> Iterator[NDArray[np.uint8]]:
    """Yield one picture, (HEIGHT, WIDTH, 3) RGB, for each posture.

    Needs OpenGL; without a display set `MUJOCO_GL=egl`.

    Args:
        positions: (frames, 23): joint angles, rad, in the order of `Joint`, then the cube's position, m, and
            orientation, unit quaternion w x y z, in the world frame.
        side: which hand.
        cube: what it turns.
    """
    spec = build_routed(side)
    add_stickers(add_cube(spec, cube), cube)
    dress_up(spec, side)
    spec.visual.quality.shadowsize, spec.visual.quality.offsamples = SHADOW_SIZE, SAMPLES
    model = spec.compile()
    data, camera = mujoco.MjData(model), _camera(side)
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        for row in positions:
            data.qpos[:] = row
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            yield renderer.render()


def add_stickers(body: mujoco.MjsBody, cube: Cube) -> None:
    """Put a coloured square on each face of a cube."""
    body.first_geom().rgba = BLACK
    for direction, colour in STICKERS.items():
        outward = np.array(direction)
        flat = np.where(outward, STICKER_THICKNESS / 2, STICKER_SHARE * cube.side_m / 2)
        place = 0.5 * cube.side_m * outward
        body.add_site(type=mujoco.mjtGeom.mjGEOM_BOX, size=flat, pos=place, rgba=colour)


def check_drawing(asked: str) -> None:
    """Try whether pictures can be drawn here, before any work.

    Args:
        asked: the option that needs them.

    Raises:
        ValueError: they cannot, with what to try.
    """
    try:
        with (
            warnings.catch_warnings(action="ignore"),
            mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8),
        ):
            pass
    except Exception as error:  # each OpenGL library has errors of its own
        said = " ".join(str(error).split())
        raise ValueError(f"{asked}: nothing can be drawn here ({said}); set MUJOCO_GL=egl") from error


def _camera(side: Side) -> mujoco.MjvCamera:
    found, mirror = mujoco.MjvCamera(), 1.0 if side == "right" else -1.0
    found.lookat[:] = LOOKED_AT * np.array([1.0, mirror, 1.0])
    found.distance, found.azimuth, found.elevation = DISTANCE, mirror * AZIMUTH, ELEVATION
    return found
