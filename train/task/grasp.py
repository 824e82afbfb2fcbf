"""Where an episode starts: the nominal grasp and what is drawn around it.

Sources: paper section "Domain randomisation" (last paragraph); the grasp's joint angles and the centre of the cube's
draws from the released environment `AeroCubeRotateZAxis`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.actuation.arrays import Array, namespace
from aero.channels import JOINT_BOX_RAD, Joint

NOMINAL_JOINTS = np.array(
    [
        *(1.573, 0.347, 0.352),
        *(1.573, 0.401, 0.406),
        *(1.573, 0.365, 0.370),
        *(1.573, 0.515, 0.520),
        *(0.746, 0.260, -0.002, 1.075),
    ]
)
"""Joint angles with the cube in the nominal grasp, (16,) rad, order of `Joint`."""
CUBE_CENTRE = np.array([0.1, 0.0, 0.05])
"""Centre of the drawn cube positions in the world, m."""
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])

STATE_POSITIONS = len(Joint) + 7
STATE_VELOCITIES = len(Joint) + 6


@dataclass(frozen=True)
class ResetRanges:
    """How far a start may lie from the nominal grasp."""

    joint_std_rad: float = 0.1
    """Standard deviation of each joint angle; the draw is clipped to the joint box."""
    cube_offset_m: float = 0.01
    """Half width of the uniform cube offset along each axis."""
    random_orientation: bool = True
    """Whether the cube's orientation is uniform over SO(3); upright otherwise."""


PAPER_RESET = ResetRanges()
NOMINAL_RESET = ResetRanges(joint_std_rad=0.0, cube_offset_m=0.0, random_orientation=False)


def start_positions(ranges: ResetRanges, joint_normal: Array, cube_uniform: Array, orientation_normal: Array) -> Array:
    """Return generalised positions of a start.

    Args:
        ranges: how far to go.
        joint_normal: (..., 16) standard normal draws.
        cube_uniform: (..., 3) draws from [-1, 1].
        orientation_normal: (..., 4) standard normal draws; their direction is uniform over SO(3).

    Returns:
        (..., 23): joint angles (rad), cube position (m), cube orientation (unit quaternion w x y z).
    """
    xp = namespace(joint_normal)
    joints = xp.clip(NOMINAL_JOINTS + ranges.joint_std_rad * joint_normal, JOINT_BOX_RAD[:, 0], JOINT_BOX_RAD[:, 1])
    cube = CUBE_CENTRE + ranges.cube_offset_m * cube_uniform
    norm = xp.sqrt(xp.sum(orientation_normal**2, axis=-1, keepdims=True))
    direction = orientation_normal / norm
    orientation = direction if ranges.random_orientation else 0 * direction + UPRIGHT
    return xp.concatenate([joints, cube, orientation], axis=-1)


def draw_starts(rng: np.random.Generator, count: int, ranges: ResetRanges) -> NDArray[np.float64]:
    """Draw `count` starts, (count, 23)."""
    starts: NDArray[np.float64] = start_positions(
        ranges,
        rng.standard_normal((count, len(Joint))),
        rng.uniform(-1, 1, (count, 3)),
        rng.standard_normal((count, 4)),
    )
    return starts
