"""What the paper says of training, number by number, with the place where it says it; nothing is read from the code."""

from dataclasses import replace

import numpy as np
import pytest

from aero.channels import Channel
from aero.policy.settings import PAPER_DEPLOYMENT, PAPER_TRAINING
from aero.policy.task import ShownAction
from simulator.scene import Cube
from train import randomise
from train.actuation import DRAWS, IDEAL
from train.recipe import PAPER, on_gpu
from train.simulator import build_scene
from train.task import (
    CUBE_CENTRE,
    PAPER_RESET,
    PAPER_REWARD,
    PHYSICS_STEP_S,
    SENSOR_COUNT,
    LossRule,
    Task,
    begin,
    command,
    draw_starts,
    finish,
    observed,
    unpack,
)

RANDOMISED = {
    "fingertip friction": ("set", 0.5, 1.0, 5),
    "cube inertia": ("scale", 0.8, 1.2, 3),
    "cube centre of mass": ("shift", -0.005, 0.005, 3),
    "joint zero offsets": ("shift", -0.05, 0.05, 16),
    "joint dry friction": ("scale", 0.5, 2.0, 16),
    "joint armature": ("scale", 1.0, 1.05, 16),
    "link masses": ("scale", 0.9, 1.1, 21),
    "actuator position gain": ("scale", 0.8, 1.2, 7),
    "joint damping": ("scale", 0.8, 1.2, 16),
}
"""Table "dr": what is done to the nominal value, between which ends, on how many elements."""


@pytest.fixture(scope="module")
def model():
    return build_scene().compile()


def test_what_is_randomised_is_table_dr(model):
    table = {
        row.name: (row.rule, row.low, row.high, getattr(model, row.where[0][0])[row.where[0][1]].size)
        for row in randomise.table(model)
    }
    assert table == RANDOMISED


def test_the_cube_of_the_papers_section_learning_in_hand_cube_rotation(model):
    """50 mm, 69.2 g, "a fixed cube friction of 0.3", and no other part of the scene is that heavy."""
    assert Cube() == Cube(side_m=0.050, mass_kg=0.0692, friction=0.3, centre_of_mass_m=(0.0, 0.0, 0.0))
    geom = model.geom("cube")
    np.testing.assert_allclose(geom.size, 0.025)
    assert geom.friction[0] == 0.3
    assert model.body("cube").mass[0] == pytest.approx(0.0692)


def test_the_model_of_section_numerical_considerations_and_actuation_interface(model):
    """10 ms, armature 205² x 0.371e-7 kg m², k_p 1e4 on the cables and 1 on the abduction, calibrated intervals."""
    assert model.opt.timestep == 0.010
    np.testing.assert_allclose(model.dof_armature[:16], 1.56e-3, rtol=2e-3)
    gains = {channel: model.actuator_gainprm[channel, 0] for channel in Channel}
    assert gains == {channel: 1.0 if channel is Channel.THUMB_ABDUCTION else 1e4 for channel in Channel}
    intervals = [(0.0585, 0.1104)] * 4 + [(-0.1, 1.75), (0.0262, 0.0384), (0.0816, 0.1121)]
    np.testing.assert_allclose(model.actuator_ctrlrange, intervals, atol=5e-5)


def test_episodes_of_section_learning_in_hand_cube_rotation():
    """ "Physics runs at 100 Hz and the policy at 20 Hz; episodes last 500 control steps, or 25 s"."""
    for task in (Task(), PAPER.task, PAPER.task_in(PAPER.stages[0])):
        assert task.episode_steps == 500
        assert task.settings.control_rate_hz == 20.0
        assert task.episode_steps * task.settings.period_s == 25.0
        assert (task.substeps, PHYSICS_STEP_S) == (5, 0.01)
        assert task.shown_action is ShownAction.LAST
        assert task.actuation == IDEAL


@pytest.mark.parametrize(("height", "lost"), [(-0.0501, True), (-0.0499, False), (-0.041, False)])
def test_a_cube_below_minus_5_cm_is_lost_and_none_above(height, lost):
    """Section "Learning In-Hand Cube Rotation": "falls below -0.05 m", in the reward and in the end of the episode."""
    assert bool(LossRule().lost(height, 9.0)) is lost
    task, sensors = Task(), np.zeros(SENSOR_COUNT)
    sensors[int(unpack(np.arange(SENSOR_COUNT)).cube_position[2])] = height
    episode = begin(task, np.zeros(SENSOR_COUNT), np.zeros(DRAWS))
    episode, _ = command(task, episode, np.zeros(7))
    _, outcome = finish(
        task,
        episode,
        np.tile(sensors, (5, 1)),
        positions=np.zeros(23),
        velocities=np.zeros(22),
        noise=np.zeros(7),
    )
    assert bool(outcome.lost) is lost
    assert float(outcome.reward) == pytest.approx(-100.0 * 0.05 if lost else 0.0)


def test_noise_of_equation_obs_and_nothing_more():
    """ "5 mm on the six cable channels and 0.05 rad on the abduction channel", to both sides."""
    task, sensors = Task(), np.zeros(SENSOR_COUNT)
    episode = begin(task, sensors, np.zeros(DRAWS))
    expected = np.array([0.005] * 6 + [0.05])  # the abduction is last in an observation
    for side in (1.0, -1.0):
        seen = observed(task, episode, np.full(7, side)) - observed(task, episode, np.zeros(7))
        np.testing.assert_allclose(seen, [*(side * expected), *[0.0] * 7], atol=1e-12)


def test_grasp_and_scales_of_equation_action_and_table_policycfg():
    assert PAPER_TRAINING.nominal == (0.09, 0.09, 0.09, 0.09, 0.75, 0.035, 0.1)
    assert PAPER_TRAINING.scale == (0.02, 0.02, 0.02, 0.02, 0.7, 0.003, 0.012)
    assert PAPER_TRAINING.noise == (0.005, 0.005, 0.005, 0.005, 0.05, 0.005, 0.005)
    assert PAPER_TRAINING.torque_limit is None
    # The table gives the ends; the values between them are the official node's `rl_z_rotation_deploy`.
    assert PAPER_DEPLOYMENT.nominal == (0.083, 0.082, 0.082, 0.086, 0.75, 0.035, 0.1)
    assert PAPER_DEPLOYMENT.scale == (0.026, 0.026, 0.026, 0.024, 0.7, 0.003, 0.012)
    assert PAPER_DEPLOYMENT.noise == (0.0,) * 7
    assert PAPER_DEPLOYMENT.control_rate_hz == 20.0


def test_weights_of_equation_reward():
    """1 s/rad, -100 and -1; "The remaining terms ... are weighted zero throughout", and the paper caps nothing."""
    weights = replace(PAPER_REWARD.weights, rotation=0.0, fall=0.0, action_rate=0.0)
    assert (PAPER_REWARD.weights.rotation, PAPER_REWARD.weights.fall, PAPER_REWARD.weights.action_rate) == (1, -100, -1)
    assert set(vars(weights).values()) == {0.0}
    assert PAPER_REWARD.rotation_cap_rad_s == np.inf


def test_starts_of_section_domain_randomisation():
    """Standard deviation 0.1 rad, ±1 cm about the released environment's centre, orientation uniform over SO(3)."""
    assert (PAPER_RESET.joint_std_rad, PAPER_RESET.cube_offset_m, PAPER_RESET.random_orientation) == (0.1, 0.01, True)
    np.testing.assert_array_equal(CUBE_CENTRE, [0.1, 0.0, 0.05])
    starts = draw_starts(np.random.default_rng(0), 20_000, Task().reset)
    free = [1, 4, 7, 10, 12, 15]  # joints whose nominal angle is further than two sigma from a stop
    np.testing.assert_allclose(starts[:, free].std(axis=0), 0.1, rtol=0.03)
    offsets = starts[:, 16:19] - [0.1, 0.0, 0.05]
    np.testing.assert_allclose([offsets.min(), offsets.max()], [-0.01, 0.01], rtol=0.01)
    np.testing.assert_allclose(starts[:, 16:19].mean(axis=0), [0.1, 0.0, 0.05], atol=2e-4)
    turned = starts[:, 19:]
    # Uniform over SO(3): the second moments alone would pass a cube's corners.
    np.testing.assert_allclose(turned.T @ turned / len(turned), np.eye(4) / 4, atol=0.01)
    np.testing.assert_allclose((turned**4).mean(axis=0), 1 / 8, atol=0.005)


def test_the_recipe_of_section_training():
    """All that the section says, at the paper's scale."""
    large = on_gpu(PAPER)
    (stage,) = large.stages
    assert stage.steps == 3e8
    assert (large.environments, large.minibatches, large.environments // large.minibatches) == (8192, 32, 256)
    assert (stage.unroll, large.epochs, large.hidden) == (40, 4, (512, 256, 128))
    for done in (0, 1_000_000, stage.steps):
        rates = (stage.learning_rate.at(done), stage.value_learning_rate.at(done), stage.entropy_cost.at(done))
        assert rates == (3e-4, 3e-4, 1e-2)
    assert (stage.discount, stage.clipping, large.gae, stage.gradient_norm) == (0.97, 0.3, 0.95, None)
    assert (stage.rewarded, stage.action_rate, stage.turning, stage.drop_price) == (PAPER_REWARD, None, None, None)
    assert (stage.rows, stage.built, stage.any_cube, stage.reset) == ((), False, False, PAPER_RESET)
    assert (stage.episode_steps, stage.staggered, stage.frozen_updates) == (500, False, 0)
    assert randomise.TIP_FRICTION == (0.5, 1.0)
    assert large.task.settings == PAPER_TRAINING
