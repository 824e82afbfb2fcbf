"""Against `aero-open-sdk` 0.1.0.dev1, which lists thumb before fingers and works in degrees."""

import numpy as np
import pytest
from aero_open_sdk.actuations_to_joints import ActuationsToJointsModelCompact
from aero_open_sdk.aero_hand import AeroHand as SdkHand
from aero_open_sdk.joints_to_actuations import JointsToActuationsModel

from aero import JOINT_BOX_RAD, ActuationMap, protocol
from aero.actuation.representations import sdk_codes_from_angles, sdk_codes_from_joints

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


@pytest.fixture
def sdk_frames(monkeypatch):
    """What the SDK's own hand object writes to its port."""
    frames = []

    class Port:
        def __init__(self, *arguments, **options):
            pass

        def reset_input_buffer(self):
            pass

        def reset_output_buffer(self):
            pass

        def write(self, data):
            frames.append(bytes(data))
            return len(data)

        def flush(self):
            pass

    monkeypatch.setattr("aero_open_sdk.aero_hand.Serial", Port)
    return frames, SdkHand("nowhere")


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


def test_compatibility_mode_sends_its_very_bytes(sdk_frames):
    frames, hand = sdk_frames
    for posture in thumb_first(POSTURES_DEG, 12):
        hand.set_joint_positions(posture.tolist())
    assert [protocol.make_positions(codes) for codes in sdk_codes_from_joints(POSTURES_DEG)] == frames


def test_compatibility_mode_sends_its_very_bytes_for_angles(sdk_frames):
    frames, hand = sdk_frames
    angles = RNG.uniform(-30, 300, (2000, 7))
    for row in thumb_first(angles, 4):
        hand.set_actuations(row.tolist())
    assert [protocol.make_positions(codes) for codes in sdk_codes_from_angles(angles)] == frames


def test_what_rounding_and_computed_limits_are_worth():
    inside = np.clip(POSTURES_DEG, 0, BOX_DEG)
    difference = MAP.codes_from_joints(np.deg2rad(inside)).astype(int) - sdk_codes_from_joints(inside)
    # Fingers: 0.037 of 288.16 degrees at the closed end; thumb: truncation alone.
    assert difference.min(axis=0).tolist() == [0] * 7
    assert difference.max(axis=0).tolist() == [9, 9, 9, 9, 1, 1, 1]
