"""The hand as Foxglove draws it: a scene that is fixed to the frames of its bodies, and these frames in a posture."""

from __future__ import annotations

from itertools import groupby

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
from numpy.typing import ArrayLike

from model.drawn_parts import DrawnPart, PosedHand, Vector

ROOT = "world"
"""Frame that the frames of all bodies are in."""


def scene(hand: PosedHand, at: Timestamp) -> SceneUpdate:
    """Return everything that is drawn of a hand but its cables, each part in the frame of its body."""
    by_body = groupby(hand.parts(), key=lambda part: part.body)
    return SceneUpdate(entities=[_entity(body, list(parts), at) for body, parts in by_body])


def frames(hand: PosedHand, joints: ArrayLike, at: Timestamp) -> FrameTransforms:
    """Return the frames of all bodies.

    Args:
        hand: is left in the posture.
        joints: (16,) float, rad, in the order of `Joint`.
        at: time of the posture.
    """
    hand.pose(joints)
    transforms = [
        FrameTransform(
            timestamp=at,
            parent_frame_id=ROOT,
            child_frame_id=body,
            translation=_vector(position),
            rotation=_quaternion(quaternion),
        )
        for body, position, quaternion in hand.frames()
    ]
    return FrameTransforms(transforms=transforms)


def _entity(body: str, parts: list[DrawnPart], at: Timestamp) -> SceneEntity:
    entity = SceneEntity(timestamp=at, frame_id=body, id=body, frame_locked=True)
    for part in parts:
        r, g, b, a = part.rgba
        pose = Pose(position=_vector(part.position), orientation=_quaternion(part.quaternion))
        size, color = _vector(part.size), Color(r=r, g=g, b=b, a=a)
        if part.shape == "box":
            entity.cubes.append(CubePrimitive(pose=pose, size=size, color=color))
        elif part.shape == "cylinder":
            drawn = CylinderPrimitive(pose=pose, size=size, bottom_scale=1.0, top_scale=1.0, color=color)
            entity.cylinders.append(drawn)
        else:
            entity.spheres.append(SpherePrimitive(pose=pose, size=size, color=color))
    return entity


def _vector(values: Vector) -> Vector3:
    x, y, z = values.tolist()
    return Vector3(x=x, y=y, z=z)


def _quaternion(values: Vector) -> Quaternion:
    w, x, y, z = values.tolist()
    return Quaternion(w=w, x=x, y=y, z=z)
