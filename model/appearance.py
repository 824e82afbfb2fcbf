"""What a hand looks like: shells on its links, colours of its cables. No mass, no contacts.

The colours follow the figure of the tendon model in the paper: cables red, couplings blue, springs yellow and cyan,
pulleys green, links half transparent so that the transmission shows.
"""

from __future__ import annotations

from itertools import pairwise

import mujoco
import numpy as np

from model.geometry.elements import Link, Role, Vector

Rgba = tuple[float, float, float, float]

CABLE_RGBA: dict[Role, Rgba] = {
    "actuation": (0.85, 0.15, 0.12, 1.0),
    "coupling": (0.15, 0.35, 0.90, 1.0),
    "mcp_spring": (0.95, 0.80, 0.15, 1.0),
    "distal_spring": (0.10, 0.75, 0.80, 1.0),
    "cmc_spring": (0.95, 0.80, 0.15, 1.0),
}
PULLEY_RGBA: Rgba = (0.25, 0.65, 0.30, 1.0)
LINK_RGBA: Rgba = (0.86, 0.87, 0.90, 0.45)
PALM_RGBA: Rgba = (0.30, 0.32, 0.36, 1.0)
PAD_RGBA: Rgba = (0.20, 0.22, 0.26, 0.75)

SHELL_GROUP = 2
CABLE_WIDTH = 0.0007
"""Drawn radius of a cable, m."""


def dress(body: mujoco.MjsBody, link: Link) -> None:
    """Add the shell of one link to its body."""
    if link.hinge is None:
        for box in link.boxes:
            _shell(body, mujoco.mjtGeom.mjGEOM_BOX, PALM_RGBA, size=box.half, pos=box.pos, quat=box.quat)
        return
    radius = min(0.0075, max(box.half[0] for box in link.boxes) + 0.001)
    tips = [guide.pos for guide in link.guides if guide.name.endswith("_tip")]
    ends = [(0.0, 0.0, 0.0), *(child.pos for child in link.links), *tips]
    for start, end in pairwise(ends):
        _capsule(body, start, end, radius)


def _capsule(body: mujoco.MjsBody, start: Vector, end: Vector, radius: float) -> None:
    _shell(body, mujoco.mjtGeom.mjGEOM_CAPSULE, LINK_RGBA, size=(radius, 0.0, 0.0), fromto=np.array([*start, *end]))


def _shell(body: mujoco.MjsBody, kind: mujoco.mjtGeom, rgba: Rgba, **shape: object) -> None:
    body.add_geom(type=kind, rgba=rgba, mass=0.0, contype=0, conaffinity=0, group=SHELL_GROUP, **shape)
