import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import JOINT_BOX_RAD, Channel
from aero.policy.settings import PAPER_TRAINING
from aero.policy.task import targets
from simulator.routed import COMMAND_RANGE
from train import task as grasp
from train.actuation import DRAWS
from train.task import (
    HELD_RAD,
    PAPER_REWARD,
    SENSOR_COUNT,
    RewardSettings,
    Task,
    TurningWeight,
    Weights,
    begin,
    command,
    critic_state,
    finish,
    reward,
    terms,
    unpack,
)

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_starts_lie_in_the_joint_box_around_the_grasp_with_unit_orientations(seed):
    starts = grasp.draw_starts(np.random.default_rng(seed), 50, grasp.PAPER_RESET)
    joints, cube, orientation = np.split(starts, [16, 19], axis=1)
    assert ((joints >= JOINT_BOX_RAD[:, 0]) & (joints <= JOINT_BOX_RAD[:, 1])).all()
    assert (np.abs(cube - grasp.CUBE_CENTRE) <= 0.01).all()
    np.testing.assert_allclose(np.linalg.norm(orientation, axis=1), 1.0)


def all_terms(sensors, joints, action=0.0, cap=np.inf):
    return terms(
        unpack(sensors),
        joints,
        last_lengths=np.zeros(7),
        action=np.full(7, action),
        last_action=np.zeros(7),
        sent=np.zeros(7),
        period_s=0.05,
        rotation_cap_rad_s=cap,
        lost=False,
    )


def some_terms(rotation=(0.0,) * 5, height=0.0, action=0.0, cap=np.inf):
    sensors = np.zeros((5, SENSOR_COUNT))
    sensors[:, 41] = rotation
    sensors[:, 31] = height
    return all_terms(sensors, np.zeros(23), action=action, cap=cap)


@given(st.lists(st.floats(-10, 10), min_size=5, max_size=5))
def test_the_rewarded_rotation_is_the_mean_over_the_period(rotation):
    value = reward(some_terms(rotation), PAPER_REWARD, 0.05)
    np.testing.assert_allclose(value, np.mean(rotation) * 0.05, atol=1e-12)


def test_a_cap_limits_what_fast_rotation_earns():
    assert some_terms((3.0,) * 5, cap=1.0)["rotation"] == 1.0
    assert some_terms((-3.0,) * 5, cap=1.0)["rotation"] == -3.0


@given(st.floats(-1.0, 3.0), st.floats(-1.0, 3.0))
def test_turning_counts_less_the_faster_a_hand_turns_and_never_against_it(one, other):
    slower, faster = sorted((one, other))
    weight = TurningWeight()
    assert 0.04 <= weight.of(np.array(faster)) <= weight.of(np.array(slower)) <= 2.0


@pytest.mark.parametrize(
    ("rate", "weight"),
    [(-0.5, 2.0), (0.0, 2.0), (0.1, 2.0), (0.4, 1.0), (0.5, 0.6 / 0.7), (0.7, 0.5 * 0.6 / 0.9), (0.9, 0.1 * 0.6 / 1.1)],
)
def test_the_weight_of_turning_is_the_recipes(rate, weight):
    """Full weight below 0.5 rad/s, a tenth from 0.9 rad/s; times 0.6 / (0.2 + rate) within 0.4 and 2."""
    np.testing.assert_allclose(TurningWeight().of(np.array(rate)), weight)


def outcomes(task, rows, actions=None):
    """Return what periods give, each with all its sensors at one of `rows` (periods, 43); action zero when left out."""
    episode, found = begin(task, np.zeros(SENSOR_COUNT), np.zeros(DRAWS)), []
    for row, action in zip(rows, np.zeros((len(rows), 7)) if actions is None else actions, strict=True):
        episode, _ = command(task, episode, action)
        episode, outcome = finish(
            task,
            episode,
            np.tile(row, (task.substeps, 1)),
            positions=np.zeros(23),
            velocities=np.zeros(22),
            noise=np.zeros(7),
        )
        found.append(outcome)
    return found


@given(st.integers(0, 6), st.floats(-1.0, 1.0))
def test_only_the_thumbs_abduction_pushed_beyond_what_it_was_sent_pays(channel, by):
    sensors = np.zeros((5, SENSOR_COUNT))
    sensors[:, int(unpack(np.arange(SENSOR_COUNT)).lengths[channel])] = by
    pays = channel == Channel.THUMB_ABDUCTION and by > HELD_RAD
    assert all_terms(sensors, np.zeros(23))["pushed"] == pytest.approx(by - HELD_RAD if pays else 0.0)


def test_a_thumb_that_is_on_its_way_to_a_lower_target_is_not_pushed():
    task = Task(rewarded=RewardSettings(Weights(action_rate=0.0, pushed=-1.0)))
    sensors = np.zeros(SENSOR_COUNT)
    abduction = int(unpack(np.arange(SENSOR_COUNT)).lengths[Channel.THUMB_ABDUCTION])
    high, low = np.zeros(7), np.eye(7)[Channel.THUMB_ABDUCTION] * -1.0
    sensors[abduction] = PAPER_TRAINING.nominal[Channel.THUMB_ABDUCTION]
    rewards = [outcome.reward for outcome in outcomes(task, np.tile(sensors, (3, 1)), [high, low, low])]
    beyond = PAPER_TRAINING.scale[Channel.THUMB_ABDUCTION] - HELD_RAD
    np.testing.assert_allclose(rewards, [0.0, 0.0, -beyond * task.settings.period_s])


def test_letting_go_of_the_cube_is_counted_by_the_physics_step():
    sensors = np.zeros((5, SENSOR_COUNT))
    sensors[:, -1] = (0, 0, 1, 3, 2)
    values = all_terms(sensors, np.zeros(23))
    assert values["airborne"] == pytest.approx(0.4)


@given(st.lists(st.floats(-1, 1), min_size=7, max_size=7))
def test_training_targets_stay_inside_the_calibrated_ranges(action):
    low, high = np.array([COMMAND_RANGE[channel] for channel in Channel]).T
    asked = targets(np.array(action), np.array(PAPER_TRAINING.nominal), np.array(PAPER_TRAINING.scale))
    assert ((asked >= low) & (asked <= high)).all()


def test_the_critic_state_is_in_the_papers_order():
    """Section "Observation and action": forces, fingertips, the cube's position error, orientation, both velocities.

    The position is measured from (0.11, 0, 0), the grasp site of the released model.
    """
    signals = unpack(np.arange(SENSOR_COUNT, dtype=float))
    state = critic_state(np.full(14, -1.0), 200 + np.arange(23.0), 300 + np.arange(22.0), signals)
    np.testing.assert_array_equal(state[:46], [*[-1.0] * 14, *range(200, 216), *range(300, 316)])
    np.testing.assert_array_equal(state[46:68], np.arange(7, 29))
    np.testing.assert_allclose(state[68:71], [29 - 0.11, 30, 31])
    np.testing.assert_array_equal(state[71:], [32, 33, 34, 35, 39, 40, 41, 36, 37, 38])
