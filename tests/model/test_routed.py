"""The routed hand against the released tendon model: counts, masses, constants carried into the compiled model."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from aero.channels import JOINT_BOX_RAD, Channel, Joint
from model import build_routed
from model.routed import COMMAND_RANGE
from model.scene import CUBE, add_cube, add_light

SIDES = ("right", "left")


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return build_routed().compile()


def test_compiled_model_carries_the_joint_constants(model):
    assert model.dof_armature == pytest.approx(np.full(16, 1.559127e-3), rel=1e-6)
    assert model.dof_frictionloss == pytest.approx(np.full(16, 0.02))
    damping = np.asarray(model.dof_damping).reshape(16)
    assert damping == pytest.approx([0.1, 0.05, 0.05] * 4 + [0.02] * 4)
    upper = np.array(JOINT_BOX_RAD[:, 1])
    upper[Joint.THUMB_CMC] = 0.9559
    assert model.jnt_range[:, 1] == pytest.approx(upper)
    assert np.all(model.jnt_range[:, 0] == 0.0)


def test_compiled_model_carries_options_and_actuators(model):
    assert model.opt.timestep == 0.010
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER
    assert model.opt.disableflags == mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    assert (model.opt.iterations, model.opt.ls_iterations) == (5, 8)
    assert model.opt.gravity == pytest.approx([0, 0, -9.81])
    for channel in Channel:
        gain = 1.0 if channel is Channel.THUMB_ABDUCTION else 1e4
        assert model.actuator_gainprm[channel, 0] == gain
        assert model.actuator_biasprm[channel, 1] == -gain
        assert model.actuator_ctrlrange[channel] == pytest.approx(COMMAND_RANGE[channel])


def test_compiled_model_carries_the_springs(model):
    expected = {
        "mcp_spring": (352.0, 0.011376),
        "distal_spring": (4000.0, 0.021336),
        "cmc_spring": (1897.0, 0.013),
        "cable": (0.0, None),
        "coupling": (0.0, None),
    }
    for i in range(model.ntendon):
        name = model.tendon(i).name
        stiffness, rest = next(value for suffix, value in expected.items() if name.endswith(suffix))
        assert np.ravel(model.tendon_stiffness[i])[0] == stiffness
        if rest is not None:
            assert model.tendon_lengthspring[i] == pytest.approx([rest, rest])


def test_wraps_and_sides(model):
    """The paper counts 24 wraps on the finger cables, all with a side, and 8 on the thumb, two with one."""
    wraps = {}
    for i in range(model.ntendon):
        start, count = model.tendon_adr[i], model.tendon_num[i]
        cylinders = [k for k in range(start, start + count) if model.wrap_type[k] == mujoco.mjtWrap.mjWRAP_CYLINDER]
        wraps[model.tendon(i).name] = (len(cylinders), sum(model.wrap_prm[k] >= 0 for k in cylinders))
    driven = {name: w for name, w in wraps.items() if not name.endswith("spring")}
    fingers = np.sum([w for name, w in driven.items() if not name.startswith("thumb")], axis=0)
    thumb = np.sum([w for name, w in driven.items() if name.startswith("thumb")], axis=0)
    assert tuple(fingers) == (24, 24)
    assert tuple(thumb) == (8, 2)


def test_only_boxes_collide(model):
    colliding = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    assert np.all(model.geom_type[colliding] == mujoco.mjtGeom.mjGEOM_BOX)
    assert colliding.sum() == 2 + 11 + 12 + 4
    assert model.geom_friction[colliding, 0] == pytest.approx(np.full(29, 0.2))
    assert model.geom_solref[colliding] == pytest.approx(np.tile([0.02, 1.5], (29, 1)))


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("cube", [False, True])
@pytest.mark.parametrize("surroundings", [False, True])
def test_every_build_compiles_and_steps(side, cube, surroundings):
    spec = build_routed(side)
    if cube:
        add_cube(spec)
    if surroundings:
        add_light(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    assert np.all(np.isfinite(data.qpos))
    if cube:
        assert model.body("cube").mass[0] == CUBE.mass_kg
        assert data.body("cube").xpos[2] > -10.0


def test_exported_mjcf_is_the_same_model(model):
    again = mujoco.MjModel.from_xml_string(build_routed().to_xml())
    for field in ("body_mass", "body_inertia", "jnt_range", "dof_armature", "wrap_prm", "actuator_gainprm"):
        np.testing.assert_allclose(getattr(again, field), getattr(model, field), rtol=1e-5, err_msg=field)
