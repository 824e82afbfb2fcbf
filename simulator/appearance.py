"""Appearance of a hand: bones, joint pins and pads on its links, colours of its cables. No mass, no contacts.

The colours follow the figure of the tendon model in the paper: cables red, couplings blue, springs yellow and cyan,
pulleys green, pads half transparent so that the transmission shows.
"""

from itertools import pairwise

import mujoco
import numpy as np

from simulator.geometry.elements import Hinge, Link, Role

Rgba = tuple[float, float, float, float]

CABLE_RGBA: dict[Role, Rgba] = {
    "actuation": (0.85, 0.12, 0.10, 1.0),
    "coupling": (0.10, 0.30, 0.90, 1.0),
    "mcp_spring": (0.95, 0.75, 0.10, 1.0),
    "distal_spring": (0.05, 0.70, 0.80, 1.0),
    "cmc_spring": (0.95, 0.75, 0.10, 1.0),
}
PULLEY_RGBA: Rgba = (0.25, 0.65, 0.30, 1.0)
BONE_RGBA: Rgba = (0.90, 0.89, 0.85, 1.0)
PIN_RGBA: Rgba = (0.35, 0.37, 0.40, 1.0)
PAD_RGBA: Rgba = (0.95, 0.80, 0.68, 0.35)
PALM_RGBA: Rgba = (0.42, 0.45, 0.50, 1.0)

SHELL_GROUP = 2
CABLE_WIDTH = 0.0007
"""Drawn radius of a cable, m."""
BONE_RADIUS = 0.0024
"""Drawn radius of a bone, m."""
PIN_SIZE = (0.0034, 0.0062)
"""Radius and half length of a drawn joint pin, m."""


def dress(body: mujoco.MjsBody, link: Link) -> None:
    """Add the visual geoms of a link to its body."""
    for box in link.boxes:
        colour = PAD_RGBA if link.hinge else PALM_RGBA
        _draw(body, mujoco.mjtGeom.mjGEOM_BOX, colour, size=box.half, pos=box.pos, quat=box.quat)
    if link.hinge:
        _draw_bones(body, link)
        _draw_pin(body, link.hinge)


def _draw_bones(body: mujoco.MjsBody, link: Link) -> None:
    tips = [guide.pos for guide in link.guides if guide.name.endswith("_tip")]
    for start, end in pairwise([(0.0, 0.0, 0.0), *(child.pos for child in link.links), *tips]):
        _draw(
            body,
            mujoco.mjtGeom.mjGEOM_CAPSULE,
            BONE_RGBA,
            size=(BONE_RADIUS, 0.0, 0.0),
            fromto=np.array([*start, *end]),
        )


def _draw_pin(body: mujoco.MjsBody, hinge: Hinge) -> None:
    radius, half_length = PIN_SIZE
    end = half_length * np.array(hinge.axis)
    _draw(
        body,
        mujoco.mjtGeom.mjGEOM_CYLINDER,
        PIN_RGBA,
        size=(radius, 0.0, 0.0),
        fromto=np.concatenate([-end, end]),
    )


def _draw(body: mujoco.MjsBody, kind: mujoco.mjtGeom, rgba: Rgba, **shape: object) -> None:
    body.add_geom(type=kind, rgba=rgba, mass=0.0, contype=0, conaffinity=0, group=SHELL_GROUP, **shape)
