"""A hand dressed for its picture: rounded bones and palm, materials, light. The geometry is that of the model.

The mount and the palm's thin plates are left out; nothing here has mass or contacts.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from model.appearance import SHELL_GROUP, Rgba
from model.geometry import Side
from model.skeleton import COLLISION_GROUP

BONE_SHARE, WIDEST = 0.75, 0.008
"""Radius of a phalanx as a share of half its box's width, and that half at most, m."""
PALMAR = 0.0012
"""How far a phalanx reaches in front of its joint, m; the rest lies behind the cables."""
PALM_EDGE = 0.0035
"""Radius of the palm's edges, m."""
PLATE = 0.002
"""Half thickness, m, up to which a box of the palm is a plate, which is left out."""
POST_RADIUS, POST_FOOT = 0.0011, 0.003
"""Radius of a post, and where it stands in a phalanx, behind the joint, m."""
STANDS_OFF = 0.008
"""Distance from the joint from which the end of a path stands on a post, m."""
ENDS = ("_start", "_end")
"""How the guides are named at which a path ends."""
CABLE_RADIUS = 0.0010
"""m"""
SPHERE_POINTS = 40
"""Points that stand for a rounded corner."""
BONE: Rgba = (0.92, 0.90, 0.85, 0.42)
PALM: Rgba = (0.26, 0.30, 0.37, 1.0)
PIN: Rgba = (0.55, 0.58, 0.62, 1.0)
GROUND: Rgba = (0.90, 0.92, 0.95, 1.0)
GROUND_DEPTH = 0.075
"""Depth of the ground that takes the shadow, below the hand's base, m."""
BOTTOM, TOP = (0.80, 0.84, 0.89), (0.99, 0.99, 1.0)
"""Colours of the sky."""


def dress_up(spec: mujoco.MjSpec, side: Side) -> None:
    """Replace what is drawn of a hand by its dress for a picture, and light it."""
    dorsal = 1.0 if side == "right" else -1.0  # along y of a phalanx; a left hand is the reflection
    for name, rgba, shine in (("bone", BONE, 0.35), ("palm", PALM, 0.25), ("pin", PIN, 0.9)):
        spec.add_material(name=name, rgba=rgba, specular=shine, shininess=0.5)
    for body in spec.bodies:
        for geom in [geom for geom in body.geoms if geom.group == SHELL_GROUP]:
            _dress(spec, body, geom, dorsal)
        if body.joints:
            for site in [site for site in body.sites if site.name.endswith(ENDS) and abs(site.pos[1]) > STANDS_OFF]:
                _add_post(body, site, dorsal)
    palm = spec.body("palm")
    for number, corners in enumerate(_palm_parts(palm)):
        _add_hull(spec, palm, f"palm_part{number}", corners)
    for tendon in spec.tendons:
        tendon.width = CABLE_RADIUS
    _light(spec)


def _dress(spec: mujoco.MjSpec, body: mujoco.MjsBody, geom: mujoco.MjsGeom, dorsal: float) -> None:
    if geom.type == mujoco.mjtGeom.mjGEOM_BOX:
        spec.delete(geom)  # a pad, which hides the cables, or a block of palm or mount
        return
    if geom.type == mujoco.mjtGeom.mjGEOM_CAPSULE:
        box = next(other for other in body.geoms if other.group == COLLISION_GROUP)
        radius = BONE_SHARE * min(float(box.size[0]), WIDEST)
        geom.material, geom.rgba = "bone", BONE
        geom.size = np.array([radius, *geom.size[1:]])
        geom.fromto = geom.fromto + np.tile([0.0, dorsal * (radius - PALMAR), 0.0], 2)
    else:
        geom.material, geom.rgba = "pin", PIN


def _add_post(body: mujoco.MjsBody, site: mujoco.MjsSite, dorsal: float) -> None:
    """Hold the end of a cable by a post on its phalanx."""
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        material="pin",
        rgba=PIN,
        size=(POST_RADIUS, 0.0, 0.0),
        fromto=np.array([*site.pos, 0.0, dorsal * POST_FOOT, site.pos[2]]),
        mass=0.0,
        contype=0,
        conaffinity=0,
        group=SHELL_GROUP,
    )


def _palm_parts(palm: mujoco.MjsBody) -> list[NDArray[np.float64]]:
    """Return the corners, (n, 3) m, of what becomes one rounded part each: each knuckle's guard, and the palm."""
    guards: list[NDArray[np.float64]] = []
    blocks: list[NDArray[np.float64]] = []
    for geom in palm.geoms:
        is_box = geom.type == mujoco.mjtGeom.mjGEOM_BOX and geom.group == COLLISION_GROUP
        if not is_box or geom.size.min() <= PLATE:
            continue
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, geom.quat)
        signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        corners = geom.pos + (signs * (geom.size - PALM_EDGE)) @ turn.reshape(3, 3).T
        (guards if np.ptp(geom.size) == 0.0 else blocks).append(corners)
    return [*guards, np.vstack(blocks)]


def _add_hull(spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, corners: NDArray[np.float64]) -> None:
    """Draw the convex hull of balls at `corners`, (n, 3) m: a block with round edges."""
    points = (corners[:, None, :] + PALM_EDGE * _sphere()[None, :, :]).reshape(-1, 3)
    spec.add_mesh(name=name, uservert=points.ravel().tolist(), smoothnormal=True)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        material="palm",
        rgba=PALM,
        mass=0.0,
        contype=0,
        conaffinity=0,
        group=SHELL_GROUP,
    )


def _sphere() -> NDArray[np.float64]:
    """Return points, (n, 3), that are spread evenly over the unit sphere (a Fibonacci spiral)."""
    rank = np.arange(SPHERE_POINTS) + 0.5
    height, turn = 1.0 - 2.0 * rank / SPHERE_POINTS, np.pi * (1.0 + 5.0**0.5) * rank
    around = np.sqrt(1.0 - height**2)
    return np.column_stack([around * np.cos(turn), around * np.sin(turn), height])


def _light(spec: mujoco.MjSpec) -> None:
    """Light the palm from above, both hands alike, with a soft ground below."""
    for name, direction, strength, shadow in (
        ("key", (0.35, 0.0, -0.94), 0.50, True),
        ("fill", (-0.6, 0.0, -0.8), 0.15, False),
    ):
        spec.worldbody.add_light(
            name=name,
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=(-0.05, 0.0, 0.4),
            dir=direction,
            diffuse=(strength,) * 3,
            specular=(0.3,) * 3,
            castshadow=shadow,
        )
    spec.visual.headlight.ambient = (0.30,) * 3
    spec.visual.headlight.diffuse = (0.15,) * 3
    spec.visual.headlight.specular = (0.0,) * 3
    spec.visual.quality.shadowsize = 8192
    spec.visual.quality.offsamples = 16
    spec.visual.map.shadowclip = 0.4
    spec.add_material(name="ground", rgba=GROUND, specular=0.0)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        material="ground",
        rgba=GROUND,
        size=(2.0, 2.0, 0.1),
        pos=(0.0, 0.0, -GROUND_DEPTH - 0.03),
        contype=0,
        conaffinity=0,
    )
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=TOP,
        rgb2=BOTTOM,
        width=64,
        height=384,
    )
