"""What stands around a hand: the cube of the rotation task, a floor, light and sky. Add before compiling."""

from __future__ import annotations

import mujoco

CUBE_SIDE = 0.050
"""m; paper, in-hand cube rotation."""
CUBE_MASS = 0.0692
"""kg"""
CUBE_FRICTION = 0.3
CUBE_START = (0.11, 0.0, 0.05)
"""Nominal position above the palm, m."""
FLOOR_HEIGHT = -0.15
"""m"""


def add_cube(spec: mujoco.MjSpec) -> mujoco.MjsBody:
    """Add the free cube (`cube`, free joint `cube`) at its nominal start and return its body."""
    half = CUBE_SIDE / 2
    cube = spec.worldbody.add_body(name="cube", pos=CUBE_START)
    cube.add_freejoint(name="cube")
    cube.add_geom(
        name="cube",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(half, half, half),
        mass=CUBE_MASS,
        friction=(CUBE_FRICTION, 0.005, 0.0001),
        rgba=(0.90, 0.55, 0.15, 1.0),
    )
    return cube


def add_floor(spec: mujoco.MjSpec) -> None:
    """Add a plane under the hand; a dropped cube comes to rest on it."""
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0.5, 0.5, 0.05),
        pos=(0.0, 0.0, FLOOR_HEIGHT),
        rgba=(0.90, 0.90, 0.92, 1.0),
    )


def add_light(spec: mujoco.MjSpec) -> None:
    """Add two lamps and a bright sky for pictures."""
    for name, direction in (("key_light", (0.3, 0.4, -0.85)), ("fill_light", (-0.4, -0.5, -0.6))):
        spec.worldbody.add_light(
            name=name,
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            dir=direction,
            diffuse=(0.45, 0.45, 0.45),
            castshadow=False,
        )
    spec.visual.headlight.ambient = (0.35, 0.35, 0.35)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.97, 0.98, 1.0),
        rgb2=(0.80, 0.84, 0.90),
        width=64,
        height=384,
    )
