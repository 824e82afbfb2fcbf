"""Where a hand's links and cables are in a posture, and what the colours of its cables say.

Both hands of this project have the same links and joints; only the routed one knows where its cables run. So its model
is posed with the joint angles of whatever hand is looked at.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.actuation.window import COUNTS_PER_TURN
from aero.channels import Channel, Joint
from hil.view.frame import Floats
from model.geometry import Side
from model.geometry.winding import SPOOL_RADIUS
from model.routed import TENDONS, build_routed

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
