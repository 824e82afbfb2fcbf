"""Force at a fingertip, the one figure of strength the paper gives: about 12 N at stall."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from servo_law import STALL

from model import build_built


def pressed_force(finger: str) -> float:
    """Press an extended finger's pad against a fixed block with the servo at stall; return the contact force, N."""
    model = build_built().compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    pad = model.geom(f"{finger}_distal_box0")
    orientation = data.geom_xmat[pad.id].reshape(3, 3)
    palmar, distal = -orientation[:, 1], orientation[:, 2]
    block_half = 0.005
    surface = data.geom_xpos[pad.id] + 0.007 * distal + (pad.size[1] + block_half + 2e-4) * palmar

    spec = build_built()
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, orientation.ravel())
    spec.worldbody.add_geom(
        name="block", type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.01, block_half, 0.003), pos=surface, quat=quat
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    for effort in np.linspace(0.0, STALL, 40):
        data.actuator(finger).ctrl = effort
        mujoco.mj_step(model, data, 25)
    force = np.zeros(6)
    total = np.zeros(3)
    for index, contact in enumerate(data.contact):
        if model.geom("block").id in contact.geom:
            mujoco.mj_contactForce(model, data, index, force)
            total += contact.frame.reshape(3, 3).T @ force[:3]
    return float(np.linalg.norm(total))


@pytest.mark.parametrize("finger", ["index", "middle", "ring", "pinky"])
def test_fingertip_force_at_stall(finger):
    assert pressed_force(finger) == pytest.approx(12.0, abs=2.0)
