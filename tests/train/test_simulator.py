import mujoco
import numpy as np
import pytest

from aero.policy.settings import PAPER_TRAINING
from train import actuation, randomise
from train.simulator import Simulator, build_scene, positions, velocities
from train.task import PAPER_RESET, SENSOR_COUNT, SENSOR_SIZES, draw_starts, unpack

NOMINAL = np.array(PAPER_TRAINING.nominal)
BATCH = 4


@pytest.fixture(scope="module")
def model():
    return build_scene().compile()


@pytest.fixture
def starts():
    return draw_starts(np.random.default_rng(0), BATCH, PAPER_RESET)


def test_the_scene_has_the_sensors_that_the_task_names(model):
    assert model.nsensordata == SENSOR_COUNT
    edges = np.cumsum([0, *SENSOR_SIZES.values()])
    for name, edge in zip(SENSOR_SIZES, edges, strict=False):
        if name.startswith("cube"):
            assert model.sensor(name).adr[0] == edge
    assert model.sensor("index_force").adr[0] == edges[1]
    assert model.sensor("index_tip_position").adr[0] == edges[2]
    assert model.sensor("thumb_tip_position").adr[0] == edges[3] - 3


def test_a_torque_limit_bounds_what_a_cable_is_pulled_with(starts):
    closed = np.broadcast_to(NOMINAL - 0.02, (BATCH, 50, 7))
    bounded = build_scene(torque_limit=0.5).compile()
    forces = {}
    for name, one in (("free", build_scene().compile()), ("bounded", bounded)):
        with Simulator([one] * BATCH) as simulator:
            forces[name] = np.abs(unpack(simulator.advance(simulator.at(starts), closed)[1]).forces)
    stall = actuation.STALL_FORCE
    np.testing.assert_allclose(stall[[0, 4, 5]], [0.588 / 0.009, 0.588, 0.588 / 0.009])
    assert (forces["bounded"] <= 0.5 * stall + 1e-9).all()
    assert forces["free"][..., 0].max() > stall[0]


def test_a_batch_does_what_single_scenes_do(model, starts):
    draws = randomise.draw(model, np.random.default_rng(1), BATCH, randomise.table(model))
    models = randomise.models(model, draws)
    controls = np.random.default_rng(2).uniform(-1, 1, (BATCH, 5, 7)) * PAPER_TRAINING.scale + NOMINAL
    with Simulator(models, threads=2) as simulator:
        states, sensors = simulator.advance(simulator.at(starts), controls)
    for k in range(BATCH):
        data = mujoco.MjData(models[k])
        data.qpos[:] = starts[k]
        for control in controls[k]:
            data.ctrl[:] = control
            mujoco.mj_step(models[k], data)
        np.testing.assert_allclose(positions(states[k]), data.qpos, atol=1e-9)
        np.testing.assert_allclose(velocities(states[k]), data.qvel, atol=1e-6)
        np.testing.assert_allclose(sensors[k, -1], data.sensordata, atol=1e-6)


def test_the_sensors_of_a_start_see_the_start(model, starts):
    with Simulator([model] * BATCH, threads=1) as simulator:
        signals = unpack(simulator.sensors_at(starts, NOMINAL))
    np.testing.assert_allclose(signals.cube_position, starts[:, 16:19])
    np.testing.assert_allclose(signals.cube_orientation, starts[:, 19:])
    np.testing.assert_allclose(signals.lengths[:, 4], starts[:, 12])
    assert ((signals.lengths[:, :4] > 0.06) & (signals.lengths[:, :4] < 0.11)).all()
