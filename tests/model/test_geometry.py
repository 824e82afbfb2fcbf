"""The description itself: complete, and its reflection a true mirror image."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from aero.actuation import ActuationMap, load_coefficients
from aero.channels import Channel, Joint
from model import build_routed
from model.geometry import hand
from model.geometry.elements import Around
from model.geometry.mirror import reflect
from model.geometry.winding import SPOOL_RADIUS, WINDING


def test_every_path_runs_over_parts_that_exist():
    description = hand()
    links = description.base.walk()
    guides = {guide.name for link in links for guide in link.guides}
    pulleys = {pulley.name for link in links for pulley in link.pulleys}
    for cable in description.cables:
        for stop in cable.path:
            if isinstance(stop, Around):
                assert stop.pulley in pulleys
                assert stop.side is None or stop.side in guides
            else:
                assert stop in guides


def test_names_are_unique():
    links = hand().base.walk()
    for names in (
        [link.name for link in links],
        [guide.name for link in links for guide in link.guides],
        [pulley.name for link in links for pulley in link.pulleys],
    ):
        assert len(names) == len(set(names))


def test_every_joint_once_in_order():
    assert [link.hinge.joint for link in hand().base.walk() if link.hinge] == list(Joint)


def test_reflecting_twice_changes_nothing():
    assert reflect(hand("left")) == hand("right")
    assert hand("left") != hand("right")


def test_left_hand_is_the_mirror_image_in_every_posture():
    """Sites, bodies and centres of mass at equal joint angles, reflected across the plane y = 0."""
    models = [build_routed(side).compile() for side in ("right", "left")]
    angles = np.random.default_rng(3).uniform(0, 1, 16)
    right, left = (mujoco.MjData(model) for model in models)
    for model, data in zip(models, (right, left), strict=True):
        data.qpos[:] = angles
        mujoco.mj_fwdPosition(model, data)
    mirror = np.array([1.0, -1.0, 1.0])
    for field in ("site_xpos", "xpos", "xipos"):
        np.testing.assert_allclose(getattr(left, field), getattr(right, field) * mirror, atol=1e-12, err_msg=field)
    np.testing.assert_allclose(left.ten_length, right.ten_length, atol=1e-9)


def test_positive_angles_close():
    """Every finger joint moves its tip out of the palm's plane, up as the hand lies, when its angle grows."""
    model = build_routed().compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    open_height = data.site("index_tip").xpos[2]
    for joint in ("index_mcp", "index_pip", "index_dip"):
        data.qpos[:] = 0
        data.joint(joint).qpos = 0.5
        mujoco.mj_kinematics(model, data)
        assert data.site("index_tip").xpos[2] > open_height + 0.005


def test_thumb_opposes_when_abducted():
    """Abduction swings the thumb's tip over the palm."""
    model = build_routed().compile()
    data = mujoco.MjData(model)
    heights = []
    for angle in (0.0, 1.0):
        data.joint("thumb_abduction").qpos = angle
        mujoco.mj_kinematics(model, data)
        heights.append(data.site("thumb_tip").xpos[2])
    assert heights[1] > heights[0] + 0.03


def test_unknown_side():
    with pytest.raises(ValueError, match="middle"):
        hand("middle")


def test_the_map_and_the_mechanism_state_the_same_winding_radii():
    matrix = np.zeros((len(Channel), len(Joint)))
    for channel, row in WINDING.items():
        for joint, radius in row.items():
            matrix[channel, joint] = radius
    matrix[Channel.THUMB_ABDUCTION, Joint.THUMB_ABDUCTION] = 1.0
    np.testing.assert_array_equal(matrix, ActuationMap().winding_matrix)
    assert load_coefficients("paper").spool_radius == SPOOL_RADIUS


LENGTHS_AT_0_7_RAD = {
    "index_cable": 0.088728,
    "index_coupling": 0.047912,
    "index_mcp_spring": 0.009936,
    "index_distal_spring": 0.037169,
    "middle_cable": 0.089281,
    "middle_coupling": 0.047912,
    "middle_mcp_spring": 0.009936,
    "middle_distal_spring": 0.037169,
    "ring_cable": 0.088724,
    "ring_coupling": 0.047912,
    "ring_mcp_spring": 0.009936,
    "ring_distal_spring": 0.037169,
    "pinky_cable": 0.090896,
    "pinky_coupling": 0.047912,
    "pinky_mcp_spring": 0.009936,
    "pinky_distal_spring": 0.037169,
    "thumb_cmc_cable": 0.029427,
    "thumb_flexor_cable": 0.099874,
    "thumb_cmc_spring": 0.018901,
    "thumb_distal_spring": 0.036636,
}
"""Every path with all joints at 0.7 rad, m; measured on this description when its sweeps matched the released model."""


def test_paths_stay_as_they_were_checked():
    """The sweeps do not feel every pulley; this notices an edit to any point of any path."""
    model = build_routed().compile()
    data = mujoco.MjData(model)
    data.qpos[:] = 0.7
    mujoco.mj_fwdPosition(model, data)
    lengths = {model.tendon(i).name: data.ten_length[i] for i in range(model.ntendon)}
    assert lengths == pytest.approx(LENGTHS_AT_0_7_RAD, abs=1e-6)
