"""A trial with a cube through every byte: where the cube is put, what is counted, and when it counts as lost."""

from dataclasses import replace

import numpy as np
import pytest
from policies import holding, playing, policy

from aero.policy.running import Ending, RunSettings
from aero.policy.shipped import find_policy
from aero.safety import Thresholds
from firmware_emulator.hand import EmulatedHand
from hil.emulated import emulated_hand
from hil.emulated.emulated_spec import EmulatedSpec
from model.cube_plant import CubePlant, CubeWatch
from model.units import load_unit
from model.units.cable_correction import correction
from simulator.scene import CUBE
from train.evaluation.cube_trial import run_trial

SHORT = RunSettings(seconds=1.0, approach_s=0.5, wait_s=0.2)
HAND = EmulatedSpec(guarded=True, cube=CUBE)


class Held(CubePlant):
    """A cube where a test says, turned and touched as it says."""

    height, beside, touched, turned = 0.05, 0.0, True, 0.0
    placed = ()

    def place_cube(self, position, orientation=(1.0, 0.0, 0.0, 0.0)):
        super().place_cube(position, orientation)
        self.placed = (*self.placed, np.array(position))

    def cube_position(self):
        return np.array([0.1, self.beside, self.height])

    def cube_touched(self):
        return self.touched

    @property
    def cube_rotation(self):
        return self.turned


@pytest.fixture
def plant():
    return Held(load_unit("ideal").hand)


def watched(plant, heights, period_s=0.05):
    """Look at a cube once a period, at these heights."""
    watch = CubeWatch(plant, 0)
    watch.place()
    for height in heights:
        plant.height = height
        plant.advance_to(plant.time + period_s)
        watch.sample()
    return watch


@pytest.mark.parametrize(("height", "lost"), [(-0.1001, True), (-0.0999, False), (-0.05, False)])
def test_a_cube_that_left_the_hand_is_lost_and_one_that_a_gait_carries_low_is_not(height, lost, plant):
    """What happens after the loss counts no more."""
    watch = watched(plant, [0.05, height, 0.05, 0.05])
    assert watch.lost is lost
    assert watch.alive_s == pytest.approx(0.10 if lost else 0.20)


def test_a_cube_without_contact_for_a_quarter_of_a_second_is_lost_and_with_one_in_between_is_not(plant):
    plant.touched = False
    assert watched(plant, [0.05] * 6).lost
    watch = watched(plant, [0.05] * 4)
    plant.touched = True
    for touched in (True, False, False, False, False, True):
        plant.touched = touched
        plant.advance_to(plant.time + 0.05)
        watch.sample()
    assert not watch.lost


@pytest.mark.parametrize(("rate", "beside", "wedged"), [(0.2, 0.0, False), (0.05, 0.0, True), (0.2, 0.036, True)])
def test_a_kept_cube_that_is_beside_the_fingers_or_no_longer_turns_is_wedged(rate, beside, wedged, plant):
    watch = CubeWatch(plant, 0)
    watch.place()
    plant.beside = beside
    for _ in range(240):
        plant.turned += 0.05 * rate
        plant.advance_to(plant.time + 0.05)
        watch.sample()
    assert watch.wedged is wedged
    assert not watch.lost


def test_a_cube_may_bounce_for_half_a_second_as_in_training(plant):
    watch = watched(plant, [0.05] * 10)
    assert np.isnan(watch.airborne)
    plant.touched = False
    plant.advance_to(plant.time + 0.05)
    watch.sample()
    assert watch.airborne == 1.0


def test_a_person_puts_the_cube_within_2_mm_of_its_place():
    """Standard deviation along each axis about (0.11, 0, 0.05)."""
    plant = Held(load_unit("ideal").hand)
    for seed in range(400):
        CubeWatch(plant, seed).place()
    placed = np.array(plant.placed[1:])
    np.testing.assert_allclose(placed.mean(axis=0), [0.11, 0.0, 0.05], atol=4e-4)
    np.testing.assert_allclose(placed.std(axis=0), 0.002, rtol=0.12)


def test_a_trial_is_run_with_the_torque_that_the_policy_was_trained_with(monkeypatch):
    """Three tenths of a servo's 1000 register units; without a limit of its own, what the guard allows."""
    made, answer = [], EmulatedHand.receive

    def watched(self, *arguments):
        made.append(self)
        return answer(self, *arguments)

    monkeypatch.setattr(EmulatedHand, "receive", watched)
    found = {}
    for limit in (0.3, None):
        one = replace(holding(), settings=replace(holding().settings, torque_limit=limit))
        seen = []
        run_trial(
            one,
            replace(HAND, unit="ideal"),
            SHORT,
            on_step=lambda _, seen=seen: seen.append([servo.memory.get("goal_torque") for servo in made[-1].servos]),
        )
        found[limit] = seen[-1]
    assert found[0.3] == [300] * 7
    assert sorted(found[None]) == [500] * 3 + [700] * 4


def test_a_trial_keeps_the_size_of_the_currents_and_the_rate_of_the_time_alive():
    seen = []
    trial = run_trial(policy(3), HAND, SHORT, on_step=lambda step: seen.append(step.currents_a))
    np.testing.assert_allclose(trial.mean_currents_a, np.abs(seen).mean(axis=0))
    assert np.min(seen) < 0.0
    assert replace(trial, rotation_rad=3.0, alive_s=2.0).rate_rad_s == 1.5
    assert replace(trial, rotation_rad=0.0, alive_s=0.0).rate_rad_s == 0.0


def test_a_trial_follows_the_cube_from_its_placing():
    trial = run_trial(policy(), replace(HAND, seed=1), SHORT)
    assert trial.run.steps > 10
    assert 0.0 < trial.alive_s <= 1.0
    assert np.isfinite(trial.rotation_rad)
    assert trial == run_trial(policy(), replace(HAND, seed=1), SHORT)


@pytest.mark.parametrize("side", ["right", "left"])
def test_either_hand_turns_the_cube_its_own_way(side, plants):
    """The model is mirrored, so a left hand turns it clockwise; a trial counts both as forward."""
    steady, unit = find_policy("steady"), load_unit("reference")
    settings = RunSettings(seconds=4.0, correction=tuple(correction(unit, steady.settings)))
    trial = run_trial(steady, replace(HAND, side=side), settings)
    assert trial.kept
    assert trial.rotation_rad > 1.0
    assert (plants[0].cube_rotation > 1.0) is (side == "right")
    assert (plants[0].cube_rotation < -1.0) is (side == "left")


@pytest.mark.parametrize("unit", ["reference", "paper"])
def test_a_hand_that_holds_the_nominal_grasp_keeps_the_cube(unit):
    trial = run_trial(holding(), replace(HAND, unit=unit), RunSettings(seconds=2.0))
    assert trial.run.ending is Ending.TIME, trial.run.reason
    assert trial.kept
    assert trial.airborne == 0.0


def test_a_hand_that_opens_has_not_kept_the_cube():
    opening = np.tile([1.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0], (60, 1))
    trial = run_trial(playing(opening), HAND, RunSettings(seconds=3.0))
    assert trial.run.ending is Ending.TIME
    assert not trial.kept
    assert trial.alive_s < 2.5


def test_a_run_that_the_guard_ended_has_not_kept_the_cube():
    thresholds = Thresholds(current_a=0.5, current_s=0.2)
    trial = run_trial(holding(), replace(HAND, thresholds=thresholds), SHORT)
    assert trial.run.ending is Ending.STOPPED
    assert "drawn more than 0.5 A" in trial.run.reason
    assert not trial.kept


@pytest.fixture
def plants(monkeypatch):
    """Every plant with a cube that a trial makes."""
    made = []

    class Watched(CubePlant):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            made.append(self)

    monkeypatch.setattr(emulated_hand, "CubePlant", Watched)
    return made


def test_a_left_hand_mirrors_the_right_one():
    """Exactly, but for where the cube is put: a person does not mirror that."""
    made = {}
    for side in ("right", "left"):
        lengths = []
        run_trial(
            holding(), replace(HAND, side=side), SHORT, on_step=lambda step, kept=lengths: kept.append(step.lengths)
        )
        made[side] = np.array(lengths)
    np.testing.assert_allclose(made["left"], made["right"], atol=2e-3)
