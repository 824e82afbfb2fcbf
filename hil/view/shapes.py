"""The shapes of the model's geoms as triangles."""

from __future__ import annotations

from itertools import product

import mujoco
import numpy as np
import trimesh

from hil.view.frame import Floats

ROUNDING_M = 0.0025
"""Radius of the edges of a drawn box."""


def mesh_of(model: mujoco.MjModel, geom: int, *, thickness: float) -> trimesh.Trimesh:
    """Return one geom as triangles in its body's frame; `thickness` scales the radius of a capsule."""
    size, kind = model.geom_size[geom], model.geom_type[geom]
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        mesh = _rounded_box(size)
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        mesh = trimesh.creation.capsule(height=2.0 * size[1], radius=thickness * size[0], count=(12, 12))
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        mesh = trimesh.creation.cylinder(radius=size[0], height=2.0 * size[1], sections=24)
    else:
        raise ValueError(f"the hand's model has a geom of a kind that the page does not draw: {mujoco.mjtGeom(kind)}")
    turn = np.eye(4)
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, model.geom_quat[geom])
    turn[:3, :3], turn[:3, 3] = matrix.reshape(3, 3), model.geom_pos[geom]
    mesh.apply_transform(turn)
    return mesh


def _rounded_box(half: Floats) -> trimesh.Trimesh:
    """Return a box with round edges: the hull of a small ball at each of its corners."""
    radius = min(ROUNDING_M, 0.45 * float(min(half)))
    ball = trimesh.creation.uv_sphere(radius=radius, count=(12, 12)).vertices
    corners = (half - radius) * np.array(list(product((-1.0, 1.0), repeat=3)))
    hull: trimesh.Trimesh = trimesh.convex.convex_hull((corners[:, None] + ball).reshape(-1, 3))
    return hull
