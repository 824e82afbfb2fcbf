"""Drawn parts of a hand: boxes, cylinders and balls in the frames of its bodies, and the poses of the bodies.

Used by the live page and the export for Foxglove. All hands of this project have equal links and joints; the routed
hand is drawn for all, because only its model has cable paths.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel, Joint
from aero.side import Side
from simulator.appearance import BONE_RGBA, Rgba
from simulator.routed import TENDONS, build_routed
from simulator.skeleton import COLLISION_GROUP, GUIDE_GROUP

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class DrawnPart:
    """Shape fixed to a body of the hand."""

    body: str
    shape: Literal["box", "cylinder", "ball"]
    size: Vector
    """Extent along the shape's own axes, (3,) m; of a cylinder diameter, diameter, length."""
    position: Vector
    """Centre in the frame of the body, (3,) m."""
    quaternion: Vector
    """Orientation in the frame of the body, (4,) w x y z."""
    rgba: Rgba

    @property
    def is_bone(self) -> bool:
        """True for a part of a finger's bone."""
        return self.rgba == BONE_RGBA


class PosedHand:
    """Kinematic model of a hand, posed by joint angles, without dynamics."""

    def __init__(self, side: Side) -> None:
        """Compile the hand in its extended pose."""
        self._model = build_routed(side).compile()
        self._data = mujoco.MjData(self._model)
        self._joints = [self._model.joint(joint.label).qposadr[0] for joint in Joint]
        self.bodies = [self._model.body(i).name for i in range(1, self._model.nbody)]
        """Names of the bodies, without the world."""
        channel_of = {name: channel for channel, name in TENDONS.items()}
        self._tendons = [channel_of.get(self._model.tendon(i).name) for i in range(self._model.ntendon)]
        self.pose(np.zeros(len(Joint)))

    def pose(self, joints: ArrayLike) -> None:
        """Set the joint angles, (16,) rad, in the order of `Joint`."""
        self._data.qpos[self._joints] = joints
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_tendon(self._model, self._data)

    def frames(self) -> Iterator[tuple[str, Vector, Vector]]:
        """Yield each body's name, position, (3,) m, and orientation, (4,) w x y z, in the world frame."""
        return zip(self.bodies, self._data.xpos[1:].copy(), self._data.xquat[1:].copy(), strict=True)

    def paths(self) -> Iterator[tuple[Channel | None, Vector]]:
        """Yield each cable's channel, None for a spring or a coupling, and its points, (n, 3) m."""
        points = self._data.wrap_xpos.reshape(-1, 3)
        for channel, start, count in zip(self._tendons, self._data.ten_wrapadr, self._data.ten_wrapnum, strict=True):
            yield channel, points[start : start + count]

    def parts(self) -> Iterator[DrawnPart]:
        """Yield everything that is drawn, but for the cables."""
        model = self._model
        for geom in range(model.ngeom):
            if model.geom_group[geom] in (COLLISION_GROUP, GUIDE_GROUP):
                continue
            body = model.body(model.geom_bodyid[geom]).name
            red, green, blue, alpha = (round(value, 3) for value in model.geom_rgba[geom].tolist())
            rgba = red, green, blue, alpha
            position, quaternion = model.geom_pos[geom].copy(), model.geom_quat[geom].copy()
            radius, half_length, _ = half = model.geom_size[geom]
            kind = mujoco.mjtGeom(model.geom_type[geom])
            if kind == mujoco.mjtGeom.mjGEOM_BOX:
                yield DrawnPart(body, "box", 2.0 * half, position, quaternion, rgba)
                continue
            size = 2.0 * np.array([radius, radius, half_length])
            yield DrawnPart(body, "cylinder", size, position, quaternion, rgba)
            if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
                along = np.empty(3)
                mujoco.mju_rotVecQuat(along, np.array([0.0, 0.0, half_length]), quaternion)
                for end in (position - along, position + along):
                    yield DrawnPart(body, "ball", np.full(3, 2.0 * radius), end, quaternion, rgba)
