"""The hand as Foxglove draws it: one frame a link, a scene that is fixed to the frames, and the frames in a posture."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp
from numpy.typing import ArrayLike, NDArray

from model import geometry
from model.appearance import BONE_RGBA, PALM_RGBA, PIN_RGBA, Rgba
from model.geometry.elements import Link

ROOT = "world"
"""Frame that the hand's base stands in."""
BONE_RADIUS = 0.0055
"""Of a drawn digit, m: a little less than the pads'."""
PIN_RADIUS = 0.0062
"""Of a drawn joint, m."""

Point = tuple[float, float, float]


def scene(side: geometry.Side, at: Timestamp) -> SceneUpdate:
    """Return everything that is drawn of a hand, each part in the frame of its link."""
    entities = [_entity(link, at) for link in geometry.hand(side).base.walk()]
    return SceneUpdate(entities=entities)


def fixed_frames(side: geometry.Side, at: Timestamp) -> FrameTransforms:
    """Return the frames that no joint moves."""
    found = [_frame(parent, link, at) for parent, link in _pairs(side) if link.hinge is None]
    return FrameTransforms(transforms=found)


def moving_frames(side: geometry.Side, joints: ArrayLike, at: Timestamp) -> FrameTransforms:
    """Return the frames that joints move.

    Args:
        side: which hand.
        joints: (16,) float, rad, in the order of `Joint`.
        at: time of the posture.
    """
    angles = np.asarray(joints, float)
    found = [_frame(parent, link, at, angles[link.hinge.joint]) for parent, link in _pairs(side) if link.hinge]
    return FrameTransforms(transforms=found)


def _pairs(side: geometry.Side) -> Iterator[tuple[str, Link]]:
    """Return each link with the name of its parent's frame, parents first."""
    base = geometry.hand(side).base
    yield ROOT, base
    for parent in base.walk():
        for child in parent.links:
            yield parent.name, child


def _frame(parent: str, link: Link, at: Timestamp, angle: float = 0.0) -> FrameTransform:
    quat = np.array(link.quat) / np.linalg.norm(link.quat)
    if link.hinge is not None:
        turn, turned = np.empty(4), np.empty(4)
        mujoco.mju_axisAngle2Quat(turn, np.array(link.hinge.axis), angle)
        mujoco.mju_mulQuat(turned, quat, turn)
        quat = turned
    return FrameTransform(
        timestamp=at,
        parent_frame_id=parent,
        child_frame_id=link.name,
        translation=_vector(link.pos),
        rotation=_quaternion(quat),
    )


def _entity(link: Link, at: Timestamp) -> SceneEntity:
    tips = [guide.pos for guide in link.guides if guide.name.endswith("_tip")]
    ends = [*(child.pos for child in link.links), *tips] if link.hinge else []
    return SceneEntity(
        timestamp=at,
        frame_id=link.name,
        id=link.name,
        frame_locked=True,
        cubes=[_cube(box.pos, box.quat, box.half) for box in link.boxes if not link.hinge],
        cylinders=[_bone(end) for end in ends],
        spheres=[
            *([_ball((0.0, 0.0, 0.0), PIN_RADIUS, PIN_RGBA)] if link.hinge else []),
            *(_ball(tip, BONE_RADIUS, BONE_RGBA) for tip in tips),
        ],
    )


def _cube(pos: Point, quat: tuple[float, ...], half: Point) -> CubePrimitive:
    size = _vector(tuple(2 * value for value in half))
    return CubePrimitive(pose=_pose(pos, quat), size=size, color=_colour(PALM_RGBA))


def _bone(end: Point) -> CylinderPrimitive:
    """Return a cylinder from the link's origin to a point."""
    along = np.array(end)
    quat: NDArray[np.float64] = np.empty(4)
    mujoco.mju_quatZ2Vec(quat, along)
    middle = _pose(tuple(along / 2), quat)
    size = _vector((2 * BONE_RADIUS, 2 * BONE_RADIUS, float(np.linalg.norm(along))))
    return CylinderPrimitive(pose=middle, size=size, bottom_scale=1.0, top_scale=1.0, color=_colour(BONE_RGBA))


def _ball(pos: Point, radius: float, rgba: Rgba) -> SpherePrimitive:
    size = _vector((2 * radius,) * 3)
    return SpherePrimitive(pose=_pose(pos, (1.0, 0.0, 0.0, 0.0)), size=size, color=_colour(rgba))


def _pose(pos: tuple[float, ...], quat: ArrayLike) -> Pose:
    return Pose(position=_vector(pos), orientation=_quaternion(quat))


def _vector(values: tuple[float, ...]) -> Vector3:
    x, y, z = (float(value) for value in values)
    return Vector3(x=x, y=y, z=z)


def _quaternion(quat: ArrayLike) -> Quaternion:
    w, x, y, z = (float(value) for value in np.asarray(quat))
    return Quaternion(w=w, x=x, y=y, z=z)


def _colour(rgba: Rgba) -> Color:
    r, g, b, a = rgba
    return Color(r=r, g=g, b=b, a=a)
