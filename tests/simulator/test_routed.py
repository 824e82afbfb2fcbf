"""The routed hand against the released tendon model: counts, masses, constants carried into the compiled model."""

import mujoco
import numpy as np
import pytest

from aero.channels import Channel
from simulator import build_routed
from simulator.routed import COMMAND_RANGE
from simulator.scene import CUBE, add_cube, add_light


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return build_routed().compile()


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


def test_only_boxes_collide(model):
    colliding = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    assert np.all(model.geom_type[colliding] == mujoco.mjtGeom.mjGEOM_BOX)
    assert colliding.sum() == 2 + 11 + 12 + 4
    assert model.geom_friction[colliding, 0] == pytest.approx(np.full(29, 0.2))
    assert model.geom_solref[colliding] == pytest.approx(np.tile([0.02, 1.5], (29, 1)))


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("around", [(), (add_cube,), (add_cube, add_light)])
def test_every_build_compiles_and_steps(side, around):
    spec = build_routed(side)
    for add in around:
        add(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    assert np.all(np.isfinite(data.qpos))
    assert not around or model.body("cube").mass[0] == CUBE.mass_kg


def test_exported_mjcf_is_the_same_model(model):
    again = mujoco.MjModel.from_xml_string(build_routed().to_xml())
    for field in ("body_mass", "body_inertia", "jnt_range", "dof_armature", "wrap_prm", "actuator_gainprm"):
        np.testing.assert_allclose(getattr(again, field), getattr(model, field), rtol=1e-5, err_msg=field)
