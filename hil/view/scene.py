"""The drawn hand: the links of the model, its cables, and the bones of the commanded posture.

Both hands of this project have the same links and joints; only the routed one knows where its cables run. So its model
is posed with the joint angles of whatever hand is looked at.
"""

from __future__ import annotations

import math
from itertools import product

import mujoco
import numpy as np
import trimesh
import viser
from numpy.typing import NDArray

from aero.actuation.window import COUNTS_PER_TURN
from aero.channels import CABLES, Channel, Joint
from hil.view.frame import Floats
from model.appearance import CABLE_WIDTH
from model.geometry import Side
from model.geometry.winding import SPOOL_RADIUS
from model.routed import TENDONS, build_routed
from model.skeleton import COLLISION_GROUP, GUIDE_GROUP

Rgb = tuple[int, int, int]
TAUT, SLACK, UNSEEN, OTHER, COMMANDED = (214, 69, 32), (38, 110, 214), (120, 120, 128), (196, 190, 176), (140, 60, 200)
"""Colours of a taut and a slack cable, of one that nothing is known of, of springs and couplings, of the commanded
posture. Red and blue stay apart for the colour-blind."""
JUST_LOOSE_M = 2.0 * math.pi * SPOOL_RADIUS / COUNTS_PER_TURN
"""A cable is shown slack from here on: one count of its servo's encoder, 14 µm, which is the least that winds it in."""


def cable_colour(loose_m: float) -> Rgb:
    """Return the colour of a cable with this much of it loose, m; NaN when nobody knows."""
    if math.isnan(loose_m):
        return UNSEEN
    return SLACK if loose_m >= JUST_LOOSE_M else TAUT


class PosedHand:
    """The routed hand's model, moved by its joint angles alone."""

    def __init__(self, side: Side) -> None:
        self.model = build_routed(side).compile()
        self.data = mujoco.MjData(self.model)
        self._joints = np.array([self.model.joint(joint.label).qposadr[0] for joint in Joint])
        channel_of = {name: channel for channel, name in TENDONS.items()}
        self._channels = [channel_of.get(self.model.tendon(i).name) for i in range(self.model.ntendon)]
        self._segments = 2 * self.model.nwrap
        """The most that all paths together may have; a pulley has two points where the cable touches it."""

    def pose(self, joints: Floats) -> None:
        """Take a posture, (16,) rad."""
        self.data.qpos[self._joints] = joints
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_tendon(self.model, self.data)

    def paths(self, colours: dict[Channel, Rgb]) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return the straight pieces of all cables and springs, (n, 2, 3) m, and their colours, (n, 2, 3).

        The number of pieces is the same in every posture; those that are not needed have no length.
        """
        points = np.zeros((self._segments, 2, 3), np.float32)
        painted = np.full((self._segments, 2, 3), _linear(OTHER), np.uint8)
        touched = self.data.wrap_xpos.reshape(-1, 3)
        used = 0
        for tendon, channel in enumerate(self._channels):
            first, count = self.data.ten_wrapadr[tendon], self.data.ten_wrapnum[tendon]
            path, pieces = touched[first : first + count], slice(used, used + count - 1)
            points[pieces, 0], points[pieces, 1] = path[:-1], path[1:]
            if channel is not None:
                painted[pieces] = _linear(colours[channel])
            used += count - 1
        points[used:] = touched[0]
        return points, painted


def _linear(colour: Rgb) -> tuple[float, ...]:
    """Return a colour as linear light, which is what viser 1.1 takes the colours of single pieces of a line for."""
    return tuple(255.0 * (part / 255.0) ** 2.2 for part in colour)


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


CABLE_M = 3.0 * CABLE_WIDTH
"""Drawn diameter of a cable, half as much again as in pictures of the model."""
GHOST_OPACITY, PAD_OPACITY = 0.45, 0.22
"""Opacity of the commanded bones, and of pads, through which the cables have to be seen."""
GHOST_THICKNESS = 0.8
"""Thickness of a commanded bone, which so vanishes in the bone that is where it should be."""
STILL = 1e-6
"""Motion (m, quaternion) that is not worth sending."""
CAMERA = {"position": (0.05, -0.24, 0.40), "look_at": (0.088, -0.018, 0.0), "up": (1.0, 0.0, 0.0)}
"""Over the palm of a right hand from its thumb's side, fingers up; m."""
FIELD_OF_VIEW_RAD = 0.62


class DrawnHand:
    """A hand on the page, with the bones of the commanded posture in it."""

    def __init__(self, server: viser.ViserServer, side: Side) -> None:
        self._server = server
        self._shown, self._wanted = PosedHand(side), PosedHand(side)
        self._shown.pose(np.zeros(len(Joint)))
        server.scene.set_up_direction(CAMERA["up"])
        mirror = 1.0 if side == "right" else -1.0
        for name in ("position", "look_at"):
            x, y, z = CAMERA[name]
            setattr(server.initial_camera, name, (x, mirror * y, z))
        server.initial_camera.up, server.initial_camera.fov = CAMERA["up"], FIELD_OF_VIEW_RAD
        self._links = _draw_links(server, self._shown.model)
        self._ghost = _draw_bones(server, self._wanted.model)
        points, colours = self._shown.paths(dict.fromkeys(CABLES, UNSEEN))
        self._cables = server.scene.add_line_segments("/cables", points, colours, thickness=CABLE_M)
        self.shows_commanded = True

    def pose(self, joints: Floats, commanded: Floats, loose: Floats) -> None:
        """Show a posture, (16,) rad, the commanded one, (16,) rad or NaN, and the cables, (7,) m loose or NaN."""
        self._shown.pose(joints)
        points, colours = self._shown.paths({channel: cable_colour(loose[channel]) for channel in CABLES})
        known = bool(np.isfinite(commanded).all())
        if known:
            self._wanted.pose(commanded)
        with self._server.atomic():
            _place(self._links, self._shown.data)
            if known:
                _place(self._ghost, self._wanted.data)
            for bone in self._ghost.values():
                bone.visible = known and self.shows_commanded
            self._cables.points, self._cables.colors = points, colours


def _place(links: dict[int, viser.FrameHandle], data: mujoco.MjData) -> None:
    for body, handle in links.items():
        place, turn = data.xpos[body], data.xquat[body]
        if np.abs(handle.position - place).max() > STILL:
            handle.position = place
        if np.abs(handle.wxyz - turn).max() > STILL:
            handle.wxyz = turn


def _draw_links(server: viser.ViserServer, model: mujoco.MjModel) -> dict[int, viser.FrameHandle]:
    hidden = (COLLISION_GROUP, GUIDE_GROUP)
    return _draw(server, model, "hand", [i for i in range(model.ngeom) if model.geom_group[i] not in hidden])


def _draw_bones(server: viser.ViserServer, model: mujoco.MjModel) -> dict[int, viser.FrameHandle]:
    capsules = [i for i in range(model.ngeom) if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_CAPSULE]
    return _draw(server, model, "commanded", capsules, COMMANDED)


def _draw(
    server: viser.ViserServer, model: mujoco.MjModel, root: str, geoms: list[int], colour: Rgb | None = None
) -> dict[int, viser.FrameHandle]:
    """Draw geoms below one frame a body; those of one body and colour are one mesh. Returns the frames by body."""
    frames: dict[int, viser.FrameHandle] = {}
    looks: dict[tuple[int, tuple[float, ...]], list[trimesh.Trimesh]] = {}
    for geom in geoms:
        look = int(model.geom_bodyid[geom]), tuple(model.geom_rgba[geom].tolist())
        looks.setdefault(look, []).append(mesh_of(model, geom, thickness=GHOST_THICKNESS if colour else 1.0))
    for number, ((body, rgba), meshes) in enumerate(looks.items()):
        path = f"/{root}/{model.body(body).name}"
        if body not in frames:
            frames[body] = server.scene.add_frame(path, show_axes=False)
        whole = trimesh.util.concatenate(meshes)
        assert isinstance(whole, trimesh.Trimesh)
        red, green, blue, opacity = rgba
        server.scene.add_mesh_simple(
            f"{path}/{number}",
            whole.vertices,
            whole.faces,
            color=colour or (round(red * 255), round(green * 255), round(blue * 255)),
            opacity=GHOST_OPACITY if colour else None if opacity == 1.0 else PAD_OPACITY,
            cast_shadow=False,
            receive_shadow=False,
        )
    return frames
