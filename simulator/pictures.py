"""Pictures of a hand, alone or with the cube. OpenGL is required; set `MUJOCO_GL=egl` on a machine without display."""

import warnings
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import Joint
from aero.side import Side
from aero.whole_file import whole
from simulator.appearance import CABLE_RGBA, PULLEY_RGBA, Rgba
from simulator.routed import build_routed
from simulator.scene import CUBE, Cube, add_cube, add_light

Picture = NDArray[np.uint8]
"""RGB image, (height, width, 3)."""
WIDTH, HEIGHT, DPI = 1500, 1000, 100
FILM_WIDTH, FILM_HEIGHT = 720, 540
FINER = 2
"""Pixels drawn for a pixel of a film, each way: software OpenGL does not smooth edges."""
CAMERA = ((0.100, 0.004, -0.005), 0.235, -20.0, -55.0)
FILM_CAMERA = ((0.157, 0.003, 0.0), 0.29, 150.0, -48.0)
"""Target point (world frame, m), distance, m, azimuth and elevation (MuJoCo's, degrees) for a right hand; mirrored for
a left one."""
LEGEND: tuple[tuple[str, Rgba], ...] = (
    ("cable of a servo", CABLE_RGBA["actuation"]),
    ("coupling of PIP and DIP", CABLE_RGBA["coupling"]),
    ("return spring of MCP or CMC", CABLE_RGBA["mcp_spring"]),
    ("return spring of the outer joints", CABLE_RGBA["distal_spring"]),
    ("pulley", PULLEY_RGBA),
)
_ANGLES = (*[0.10] * 3, *[0.16] * 3, *[0.24] * 3, *[0.32] * 3, 1.1, 0.3, 0.25, 0.25)
POSE = dict(zip(Joint, _ANGLES, strict=True))
STICKERS: dict[tuple[int, int, int], Rgba] = {
    (1, 0, 0): (0.80, 0.15, 0.15, 1.0),
    (-1, 0, 0): (0.95, 0.55, 0.10, 1.0),
    (0, 1, 0): (0.15, 0.55, 0.25, 1.0),
    (0, -1, 0): (0.15, 0.30, 0.75, 1.0),
    (0, 0, 1): (0.95, 0.95, 0.95, 1.0),
    (0, 0, -1): (0.95, 0.85, 0.15, 1.0),
}
"""Colour of each face by its outward normal, as on a puzzle cube, to make the direction of a rotation visible."""
BLACK: Rgba = (0.12, 0.12, 0.13, 1.0)
"""Colour of the cube between its stickers."""
STICKER_FRACTION, STICKER_THICKNESS = 0.8, 0.2e-3
"""Side of a sticker over the side of the cube; its thickness, m."""


def picture(spec: mujoco.MjSpec, side: Side = "right") -> Picture:
    """Draw the palm of a hand in the half-open `POSE`, (HEIGHT, WIDTH, 3).

    Args:
        spec: the hand, which is copied.
        side: side of the hand.
    """
    lit = spec.copy()
    add_light(lit)
    lit.visual.global_.offwidth, lit.visual.global_.offheight = WIDTH, HEIGHT
    model = lit.compile()
    data = mujoco.MjData(model)
    for joint, angle in POSE.items():
        data.joint(joint.label).qpos = angle
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        return _drawn(renderer, model, data, _camera(side, *CAMERA))


def write_picture(spec: mujoco.MjSpec, path: Path, side: Side = "right") -> None:
    """Write `picture` as a PNG file, with a legend of the cables' colours."""
    # A film needs no plots.
    from matplotlib.figure import Figure  # noqa: PLC0415
    from matplotlib.lines import Line2D  # noqa: PLC0415

    figure = Figure(figsize=(WIDTH / DPI, HEIGHT / DPI), dpi=DPI)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(picture(spec, side))
    axes.set_axis_off()
    lines = [Line2D([], [], color=rgba, linewidth=6, label=label, solid_capstyle="round") for label, rgba in LEGEND]
    axes.legend(handles=lines, loc="lower left", frameon=False, fontsize=17, borderaxespad=1.5, handlelength=1.4)
    with whole(path) as draft:
        figure.savefig(draft)


def frames(positions: NDArray[np.float64], side: Side = "right", cube: Cube = CUBE) -> Iterator[Picture]:
    """Yield one picture of the routed hand with its cube, (FILM_HEIGHT, FILM_WIDTH, 3), for each posture.

    Args:
        positions: (frames, 23): joint angles, rad, in the order of `Joint`, then the cube's position, m, and
            orientation, unit quaternion w x y z, in the world frame.
        side: side of the hand.
        cube: the cube to draw.
    """
    spec = build_routed(side)
    add_stickers(add_cube(spec, cube), cube)
    add_light(spec)
    height, width = FINER * FILM_HEIGHT, FINER * FILM_WIDTH
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    model = spec.compile()
    data, camera = mujoco.MjData(model), _camera(side, *FILM_CAMERA)
    with mujoco.Renderer(model, height, width) as renderer:
        for row in positions:
            data.qpos[:] = row
            fine = _drawn(renderer, model, data, camera).reshape(FILM_HEIGHT, FINER, FILM_WIDTH, FINER, 3)
            yield fine.mean(axis=(1, 3)).astype(np.uint8)


def add_stickers(body: mujoco.MjsBody, cube: Cube) -> None:
    """Add a coloured square to each face of a cube."""
    body.first_geom().rgba = BLACK
    for direction, colour in STICKERS.items():
        outward = np.array(direction)
        flat = np.where(outward, STICKER_THICKNESS / 2, STICKER_FRACTION * cube.side_m / 2)
        place = 0.5 * cube.side_m * outward
        body.add_site(type=mujoco.mjtGeom.mjGEOM_BOX, size=flat, pos=place, rgba=colour)


def check_drawing(asked: str) -> None:
    """Check before any work that pictures can be drawn on this machine.

    Args:
        asked: the option that needs pictures.

    Raises:
        ValueError: OpenGL fails; the message names a remedy.
    """
    try:
        with (
            warnings.catch_warnings(action="ignore"),
            mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8),
        ):
            pass
    except Exception as error:  # each OpenGL library raises different exceptions
        said = " ".join(str(error).split())
        raise ValueError(f"{asked}: nothing can be drawn here ({said}); set MUJOCO_GL=egl") from error


def _drawn(renderer: mujoco.Renderer, model: mujoco.MjModel, data: mujoco.MjData, camera: mujoco.MjvCamera) -> Picture:
    mujoco.mj_forward(model, data)
    renderer.update_scene(data, camera)
    rgb: Picture = renderer.render()
    return rgb


def _camera(
    side: Side, looked_at: tuple[float, float, float], distance: float, azimuth: float, elevation: float
) -> mujoco.MjvCamera:
    found, mirror = mujoco.MjvCamera(), 1.0 if side == "right" else -1.0
    found.lookat[:] = looked_at * np.array([1.0, mirror, 1.0])
    found.distance, found.azimuth, found.elevation = distance, mirror * azimuth, elevation
    return found
