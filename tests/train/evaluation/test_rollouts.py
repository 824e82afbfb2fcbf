"""What is counted in an episode, on a physics that is a script."""

import numpy as np
import pytest
from policies import holding, policy

from aero.policy.settings import PAPER_TRAINING
from train.evaluation.rollouts import run, task_of
from train.simulator import Simulator
from train.task import SENSOR_COUNT, unpack

HANDS, PERIODS, SUBSTEPS, PERIOD_S = 3, 40, 5, 0.05
PLACES = unpack(np.arange(SENSOR_COUNT))
HEIGHT, SPIN = int(PLACES.cube_position[2]), [int(place) for place in PLACES.cube_angular_velocity]
CONTACTS = int(PLACES.cube_contacts[0])


class Script(Simulator):
    """Sensors (periods, hands, substeps, 43), whatever is commanded."""

    def __init__(self, sensors):
        self.state_size, self._sensors, self._period = 46, sensors, -1
        self.controls = []

    def __len__(self):
        return self._sensors.shape[1]

    def advance(self, states, controls):
        if self._period < 0:
            self._period = 0
            return states, np.zeros((len(self), controls.shape[1], SENSOR_COUNT))
        self.controls.append(controls)
        self._period += 1
        return states, self._sensors[self._period - 1]


@pytest.fixture
def sensors():
    """A cube that turns by 5 rad/s in the last of five steps and tumbles besides, and is held in the hand."""
    values = np.zeros((PERIODS, HANDS, SUBSTEPS, SENSOR_COUNT))
    values[..., -1, SPIN[2]] = 5.0
    values[..., SPIN[:2]] = 7.0
    values[..., CONTACTS] = 3.0
    return values


def test_rotation_is_that_about_the_vertical_at_every_step(sensors):
    episodes = run(holding(), task_of(holding()), Script(sensors), PERIODS * PERIOD_S)
    np.testing.assert_allclose(episodes.rotation_rad, PERIODS * PERIOD_S * 1.0)
    np.testing.assert_allclose(episodes.rate_rad_s, 1.0)
    assert episodes.kept.all()
    np.testing.assert_allclose(episodes.alive_s, PERIODS * PERIOD_S)


def test_an_episode_counts_to_its_loss_and_no_further(sensors):
    """The second loses its cube in the tenth period, in which it comes to lie below -0.1 m, and comes back."""
    sensors[9, 1, -1, HEIGHT] = -0.11
    sensors[9:, 1, :, SPIN[2]] = 100.0
    sensors[:9, 1, :, SPIN[2]] = 2.0
    episodes = run(holding(), task_of(holding()), Script(sensors), PERIODS * PERIOD_S)
    np.testing.assert_array_equal(episodes.kept, [True, False, True])
    assert episodes.alive_s[1] == pytest.approx(0.5)
    assert episodes.rotation_rad[1] == pytest.approx(9 * PERIOD_S * 2.0 + PERIOD_S * 100.0)
    summary = episodes.summary()
    assert summary["survival"] == pytest.approx(2 / 3)
    assert summary["rate_rad_s"] == pytest.approx((2.0 + episodes.rotation_rad[1] + 2.0) / 4.5)
    assert summary["rotation_median_rad"] == pytest.approx(2.0)


def test_a_cube_is_airborne_by_the_physics_step_once_it_has_settled(sensors):
    """For half a second it may bounce; then two of five steps touch nothing, but in the third hand."""
    sensors[:, :, 3:, CONTACTS] = 0.0
    sensors[:10, :, :2, CONTACTS] = 0.0
    sensors[:, 2, :, CONTACTS] = 1.0
    sensors[19, 0, -1, HEIGHT] = -0.11
    episodes = run(holding(), task_of(holding()), Script(sensors), PERIODS * PERIOD_S)
    np.testing.assert_allclose(episodes.airborne, [0.4, 0.4, 0.0])
    assert episodes.summary()["airborne"] == pytest.approx((0.4 * 1.0 + 0.4 * 2.0) / (1.0 + 2.0 + 2.0))


def test_the_travel_is_that_of_what_is_commanded(sensors):
    the_policy, batch = policy(3), Script(sensors)
    episodes = run(the_policy, task_of(the_policy), batch, PERIODS * PERIOD_S)
    asked = np.array(batch.controls)[:, :, -1]
    nominal = np.broadcast_to(PAPER_TRAINING.nominal, (1, HANDS, 7))
    steps = np.abs(np.diff(np.concatenate([nominal, asked]), axis=0))
    np.testing.assert_allclose(episodes.travel_per_s, steps.sum(axis=0) / (PERIODS * PERIOD_S), rtol=1e-6)
    assert episodes.summary()["finger_travel_m_s"] == pytest.approx(episodes.travel_per_s[:, :4].mean())
