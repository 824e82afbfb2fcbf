from dataclasses import replace

import numpy as np
import pytest
from policies import holding, policy

from aero.policy.settings import PAPER_DEPLOYMENT, PAPER_TRAINING
from train.evaluation.rollouts import run, task_of
from train.evaluation.simulation import BUILT, beside_a_deployment, conditions, measure
from train.simulator import Simulator, build_scene
from train.task import LossRule

BATCH = 4


@pytest.fixture(scope="module")
def batch():
    with Simulator([build_scene().compile()] * BATCH, threads=1) as simulator:
        yield simulator


def test_the_same_seed_gives_the_same_episodes_and_another_others(batch):
    first, again, other = (run(policy(), task_of(policy()), batch, 1.0, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.rotation_rad, again.rotation_rad)
    assert (first.rotation_rad != other.rotation_rad).all()


def test_a_hand_that_holds_still_commands_no_travel_and_hardly_turns_the_cube(batch):
    episodes = run(holding(), task_of(holding()), batch, 2.0)
    assert (episodes.travel_per_s == 0).all()
    assert (np.abs(episodes.rate_rad_s) < 1.0).all()
    assert ((episodes.airborne >= 0) & (episodes.airborne <= 1)).all()


def test_a_hand_that_opens_loses_the_cube_and_counts_only_until_then(batch):
    settings = holding().settings
    wide = np.add(settings.nominal, (0.02, 0.02, 0.02, 0.02, -0.7, 0.003, 0.012))
    # The paper's rule, because some cubes come to lie between the open fingers.
    opened = replace(task_of(holding(), replace(settings, nominal=tuple(wide))), loss=LossRule())
    episodes = run(holding(), opened, batch, 3.0)
    assert not episodes.kept.any()
    assert (episodes.alive_s < 2.0).all()
    assert episodes.summary()["survival"] == 0.0


def test_the_conditions_are_the_papers_and_the_sweep_reaches_a_control_period():
    trained, quiet, late, deployed, *servos = conditions(policy()).values()
    assert trained.settings == policy().settings
    assert max(quiet.settings.noise) == 0
    assert late.actuation.delay_s == (0.05, 0.05)
    assert deployed.settings == PAPER_DEPLOYMENT
    assert deployed.reset.joint_std_rad == 0
    swept = [(task.actuation.lag_s[0], task.actuation.delay_s[0]) for task in servos]
    assert [lag for lag, _ in swept] == [0.025] * 6 + [0.015, 0.04, 0.06]
    assert [delay for _, delay in swept] == [0.0, 0.01, 0.02, 0.03, 0.04, policy().settings.period_s] + [0.025] * 3


def test_every_condition_is_measured_by_name():
    told = []
    found = measure(policy(), 2, seconds=0.2, seed=0, progress=lambda _, name: told.append(name))
    assert list(found) == told
    assert set(conditions(policy())) | {BUILT, "lag 25, delay 50 ms", "lag 60, delay 25 ms"} <= set(found)
    assert {row["episodes"] for row in found.values()} == {2.0}


def test_beside_a_deployment_stands_the_simulator_as_trained_and_with_its_settings():
    found = beside_a_deployment(policy(3), PAPER_DEPLOYMENT, 3, seconds=0.5, seed=0)
    trained, deployed = found.values()
    assert len(trained.kept) == len(deployed.kept) == 3
    assert (trained.rotation_rad != deployed.rotation_rad).all()
    (_, same) = beside_a_deployment(policy(3), PAPER_TRAINING, 3, seconds=0.5, seed=0).values()
    assert (same.rotation_rad != deployed.rotation_rad).all()
