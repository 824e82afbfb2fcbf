"""The routed hand's own winding radii, by the construction that gave the mechanism's (paper eq. windingcoeff)."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel, Joint
from model.geometry import Side
from model.routed import TENDONS, build_routed

Floats = NDArray[np.float64]


def two_pose_radii(side: Side = "right") -> Floats:
    """Return the cable taken up over each joint's full range divided by that range, (7, 16) float, m/rad.

    One joint at a time, the others extended; kinematics only, so that nothing gives and nothing rubs. Abduction's row
    is its joint's own.
    """
    lengths = _Lengths(side)
    extended = lengths.at(np.zeros(len(Joint)))
    radii = np.zeros((len(Channel), len(Joint)))
    for joint in Joint:
        posture = np.zeros(len(Joint))
        posture[joint] = lengths.upper_limits[joint]
        radii[:, joint] = (extended - lengths.at(posture)) / posture[joint]
    radii[Channel.THUMB_ABDUCTION, Joint.THUMB_ABDUCTION] = 1.0
    return radii


def flexor_radius(side: Side = "right") -> float:
    """Return the flexor's radius with MCP and IP turning together as their coupling makes them, m/rad."""
    lengths = _Lengths(side)
    posture = np.zeros(len(Joint))
    angle = lengths.upper_limits[Joint.THUMB_MCP]
    posture[[Joint.THUMB_MCP, Joint.THUMB_IP]] = angle
    taken_up = lengths.at(np.zeros(len(Joint))) - lengths.at(posture)
    return float(taken_up[Channel.THUMB_FLEXOR] / angle)


class _Lengths:
    """Cable lengths of a posture."""

    def __init__(self, side: Side) -> None:
        self._model = build_routed(side).compile()
        self._data = mujoco.MjData(self._model)
        self._tendons = [self._model.tendon(name).id for name in TENDONS.values()]
        self.upper_limits: Floats = self._model.jnt_range[: len(Joint), 1].copy()

    def at(self, posture: Floats) -> Floats:
        self._data.qpos[:] = posture
        mujoco.mj_fwdPosition(self._model, self._data)
        lengths = np.zeros(len(Channel))
        lengths[list(TENDONS)] = self._data.ten_length[self._tendons]
        return lengths
