"""Pictures of a hand. Needs an OpenGL context; on a machine without display set `MUJOCO_GL=egl`."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from aero.channels import FINGERS, Joint
from aero.whole_file import whole
from model.appearance import CABLE_RGBA, PULLEY_RGBA, Rgba
from model.geometry import Side
from model.portrait import dress_up

WIDTH, HEIGHT = 1500, 1000
DPI = 100
LEGEND: tuple[tuple[str, Rgba], ...] = (
    ("cable of a servo", CABLE_RGBA["actuation"]),
    ("coupling of PIP and DIP", CABLE_RGBA["coupling"]),
    ("return spring of MCP or CMC", CABLE_RGBA["mcp_spring"]),
    ("return spring of the outer joints", CABLE_RGBA["distal_spring"]),
    ("pulley", PULLEY_RGBA),
)
LOOKED_AT = (0.100, 0.004, -0.005)
"""World frame, m."""
DISTANCE, AZIMUTH, ELEVATION = 0.235, -20.0, -55.0
"""Place of the camera: m and degrees, as MuJoCo counts them, for a right hand; a left one is seen in the mirror."""
CURL = (0.10, 0.16, 0.24, 0.32)
"""Angle of every joint of the fingers in a picture, rad, from index to pinky."""
THUMB_POSE = {Joint.THUMB_ABDUCTION: 1.1, Joint.THUMB_CMC: 0.3, Joint.THUMB_MCP: 0.25, Joint.THUMB_IP: 0.25}
"""rad"""


def shown_pose() -> NDArray[np.float64]:
    """Return the joint angles, (16,) rad, of a hand that is about to take something."""
    angles = np.zeros(len(Joint))
    angles[: 3 * len(FINGERS)] = np.repeat(CURL, 3)
    angles[list(THUMB_POSE)] = list(THUMB_POSE.values())
    return angles


def picture(spec: mujoco.MjSpec, side: Side = "right", joint_angles: ArrayLike | None = None) -> NDArray[np.uint8]:
    """Draw the palm of a hand.

    Args:
        spec: a hand; a copy of it is dressed, lit and compiled.
        side: which hand it is.
        joint_angles: (16,) float, rad; `shown_pose` when left out.

    Returns:
        (HEIGHT, WIDTH, 3) RGB.
    """
    dressed = spec.copy()
    dress_up(dressed, side)
    dressed.visual.global_.offwidth, dressed.visual.global_.offheight = WIDTH, HEIGHT
    model = dressed.compile()
    data = mujoco.MjData(model)
    angles = shown_pose() if joint_angles is None else np.asarray(joint_angles, dtype=float)
    for joint in Joint:
        data.joint(joint.label).qpos = angles[joint]
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        renderer.update_scene(data, camera(side))
        rgb: NDArray[np.uint8] = renderer.render()
    return rgb


def camera(side: Side) -> mujoco.MjvCamera:
    """Return where a hand is seen from."""
    found = mujoco.MjvCamera()
    mirror = 1.0 if side == "right" else -1.0
    found.lookat[:] = LOOKED_AT * np.array([1.0, mirror, 1.0])
    found.distance, found.azimuth, found.elevation = DISTANCE, mirror * AZIMUTH, ELEVATION
    return found


def write_picture(spec: mujoco.MjSpec, path: Path, side: Side = "right", joint_angles: ArrayLike | None = None) -> None:
    """Write `picture` as a PNG file, with a legend of the cables' colours."""
    figure = Figure(figsize=(WIDTH / DPI, HEIGHT / DPI), dpi=DPI)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(picture(spec, side, joint_angles))
    axes.set_axis_off()
    lines = [Line2D([], [], color=rgba, linewidth=6, label=label, solid_capstyle="round") for label, rgba in LEGEND]
    axes.legend(handles=lines, loc="lower left", frameon=False, fontsize=17, borderaxespad=1.5, handlelength=1.4)
    with whole(path) as draft:
        figure.savefig(draft)
