"""Against `aero-open-sdk` 0.1.0.dev1, which lists thumb before fingers and works in degrees."""

import numpy as np
from aero_open_sdk.actuations_to_joints import ActuationsToJointsModelCompact
from aero_open_sdk.joints_to_actuations import JointsToActuationsModel

from aero import JOINT_BOX_RAD, ActuationMap

MAP = ActuationMap()
BOX_DEG = np.rad2deg(JOINT_BOX_RAD[:, 1])
RNG = np.random.default_rng(20251028)
POSTURES_DEG = np.concatenate(
    [
        RNG.uniform(0, BOX_DEG, (2000, 16)),
        RNG.integers(0, BOX_DEG.astype(int) + 1, (2000, 16)).astype(float),
        RNG.integers(0, 2, (2000, 16)) * BOX_DEG,
        RNG.uniform(-30, 130, (1000, 16)),
    ]
)


def thumb_last(values, thumb):
    return np.concatenate([values[..., thumb:], values[..., :thumb]], axis=-1)


def thumb_first(values, others):
    return np.concatenate([values[..., others:], values[..., :others]], axis=-1)


def test_forward_model_agrees():
    sdk = JointsToActuationsModel()
    inside = np.clip(POSTURES_DEG, 0, BOX_DEG)
    theirs = np.array([sdk.hand_actuations(posture.tolist()) for posture in thumb_first(inside, 12)])
    ours = np.rad2deg(MAP.angles_from_travel(MAP.travel_from_joints(np.deg2rad(inside))))
    np.testing.assert_allclose(ours, thumb_last(theirs, 3), atol=1e-9)


def test_inverse_model_agrees():
    sdk = ActuationsToJointsModelCompact()
    low, high = MAP.excursion_rad.T
    angles = low + RNG.uniform(0, 1, (2000, 7)) * (high - low)
    theirs = np.array([sdk.hand_joints(row.tolist()) for row in thumb_first(angles, 4)])
    ours = MAP.compact_from_travel(MAP.travel_from_angles(angles))
    np.testing.assert_allclose(ours, thumb_last(theirs, 3), atol=1e-9)
