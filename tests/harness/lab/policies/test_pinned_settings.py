"""The numbers of trials, predictions and gaps, each with where it comes from."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from policies import holding, policy

from aero.policy.limits import Ending
from aero.policy.running import RunSettings
from aero.policy.settings import PAPER_DEPLOYMENT
from aero.policy.task import ShownAction
from hil import GroundTruth
from hil.lab.policies import byte_evaluation, cube_trial
from hil.lab.policies.cube_trial import run_trial
from hil.lab.policies.cube_watch import CubeWatch
from hil.lab.policies.deployment import load_deployments
from hil.lab.policies.policy_run import record_policy
from hil.lab.policies.survival import MOMENTS_S
from hil.lab.policies.transmission_gap import channel_gaps
from hil.recordings.recorder import Recorder
from hil.targets.opening import open_target
from model.cube_plant import CubePlant
from model.units import load_unit

SHORT = RunSettings(seconds=0.4, approach_s=0.3, wait_s=0.1)
FIRMWARE = ("pre", "0.1.0", "0.1.1", "0.1.2", "0.1.3", "0.1.4", "0.1.5", "0.2.0")


class Held(CubePlant):
    """A cube where a test says, turned and touched as it says."""

    height, touched, turned = 0.05, True, 0.0
    placed = ()

    def place_cube(self, position, orientation=(1.0, 0.0, 0.0, 0.0)):
        super().place_cube(position, orientation)
        self.placed = (*self.placed, np.array(position))

    def cube_position(self):
        return np.array([0.1, 0.0, self.height])

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
        watch.look()
    return watch


@pytest.mark.parametrize(("height", "lost"), [(-0.0501, True), (-0.0499, False), (-0.041, False)])
def test_a_cube_below_minus_5_cm_is_lost_as_in_the_paper(height, lost, plant):
    """Section "Learning In-Hand Cube Rotation"; what happens after the loss counts no more."""
    watch = watched(plant, [0.05, height, 0.05, 0.05])
    assert watch.lost is lost
    assert watch.alive_s == pytest.approx(0.10 if lost else 0.20)


def test_a_cube_may_bounce_for_half_a_second_as_in_training(plant):
    plant.touched = False
    assert np.isnan(watched(plant, [0.05] * 10).airborne)
    plant.touched = False
    assert watched(plant, [0.05] * 11).airborne == 1.0


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
    made = []

    class Watched(cube_trial.EmulatedHand):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            made.append(self)

    monkeypatch.setattr(cube_trial, "EmulatedHand", Watched)
    found = {}
    for limit in (0.3, None):
        one = replace(holding(), settings=replace(holding().settings, torque_limit=limit))
        seen = []
        run_trial(
            one,
            load_unit("ideal"),
            settings=SHORT,
            on_step=lambda _, seen=seen: seen.append([servo.memory.get("goal_torque") for servo in made[-1].servos]),
        )
        found[limit] = seen[-1]
    assert found[0.3] == [300] * 7
    assert sorted(found[None]) == [500] * 3 + [700] * 4


def test_a_recorded_policy_limits_a_guarded_hand_as_it_was_trained():
    one = replace(holding(), settings=replace(holding().settings, torque_limit=0.5))
    with open_target(guarded=True) as target:
        recorder = Recorder(target, "policy")
        record_policy(target, recorder, one, SHORT)
        recording = recorder.finish()
        limits = [servo.memory.get("goal_torque") for servo in target.get(GroundTruth).electronics.servos]
    assert recording.header.parameters["torque_limit"] == 0.5
    assert limits == [500] * 7


def test_a_trial_keeps_the_size_of_the_currents_and_the_rate_of_the_time_alive():
    seen = []
    trial = run_trial(
        policy(3), load_unit("reference"), settings=SHORT, on_step=lambda step: seen.append(step.currents_a)
    )
    np.testing.assert_allclose(trial.mean_currents_a, np.abs(seen).mean(axis=0))
    assert np.min(seen) < 0.0
    assert replace(trial, rotation_rad=3.0, alive_s=2.0).rate_rad_s == 1.5
    assert replace(trial, rotation_rad=0.0, alive_s=0.0).rate_rad_s == 0.0


def test_survival_is_asked_for_after_the_papers_rollout_too():
    """A trial of 15 s as in the paper's section "Behaviour in simulation", its 50 s rollout, and ten minutes."""
    assert MOMENTS_S == (15.0, 50.0, 200.0, 600.0)


DEPLOYED = {
    "ros2-node": ("paper", "pre", "deployment", True, "last", False),
    "ros2-node-0.2.0": ("plausible", "0.2.0", "deployment", True, "last", False),
    "run-policy": ("plausible", "0.2.0", "own", False, "own", False),
    "run-policy-twin": ("plausible", "0.2.0", "own", False, "own", True),
}
"""Unit, firmware, settings, a period late, shown action, corrected. The first is the paper's section "Zero-shot
deployment" on its hand, run as the official node `rl_z_rotation_deploy` does, a period late."""


def test_deployments_are_those_that_are_described():
    found = {name: tuple(asdict(row).values())[2:8] for name, row in load_deployments().items()}
    assert found == DEPLOYED
    settings = load_deployments()["ros2-node"].run_settings(15.0)
    assert settings.settings == PAPER_DEPLOYMENT
    assert (settings.one_period_late, settings.shown_action) == (True, ShownAction.LAST)
    own = load_deployments()["run-policy"].run_settings(15.0)
    assert (own.settings, own.one_period_late, own.shown_action) == (None, False, None)


def test_an_evaluation_tries_every_firmware_and_knows_which_hands_are_corrected():
    made = byte_evaluation.cases(holding(), 2, 3, seconds=1.0, seed=7)
    rows = {}
    for case in made:
        rows.setdefault(case.name, []).append(case)
    for name, cases in rows.items():
        assert {any(case.settings.correction) for case in cases} == {"not corrected" not in name}, name
    assert {case.firmware for case in made} == set(FIRMWARE)
    assert {name: len(cases) for name, cases in rows.items() if "random" in name} == {
        "random units (3)": 3,
        "random units (3), not corrected": 3,
    }
    assert all(case.firmware == "pre" for case in rows["paper, firmware pre"])
    assert [case.seed for case in rows["reference"]] == [7, 8]
    assert all(case.settings.seconds == 1.0 for case in made)


def test_figures_of_trials_are_their_means_and_extremes():
    one = run_trial(holding(), load_unit("ideal"), settings=SHORT)
    run = replace(one.run, ending=Ending.TIME, peak_current_a=1.0)
    kept = replace(
        one, kept=True, alive_s=2.0, rotation_rad=4.0, airborne=0.2, run=run,
        travel_per_s=(0.01,) * 4 + (9.0,) * 3, mean_currents_a=(0.1,) * 6 + (0.5,),
    )  # fmt: skip
    stopped = replace(
        kept, kept=False, alive_s=1.0, rotation_rad=1.0, airborne=np.nan,
        run=replace(run, ending=Ending.STOPPED, peak_current_a=3.0), travel_per_s=(0.03,) * 4 + (9.0,) * 3,
        mean_currents_a=(0.2,) * 6 + (0.1,),
    )  # fmt: skip
    (found,) = byte_evaluation.figures({"row": [kept, stopped]}).values()
    expected = {
        "episodes": 2.0,
        "survival": 0.5,
        "rate_rad_s": 1.5,
        "rotation_median_rad": 2.5,
        "airborne": 0.2,
        "finger_travel_m_s": 0.02,
        "stopped": 0.5,
        "mean_current_a": 0.3,
        "peak_current_a": 3.0,
    }
    assert {name: found[name] for name in expected} == pytest.approx(expected)


WAVE = 0.05 * np.sin(2 * np.pi * 2.0 * 0.05 * np.arange(200))[:, None] * np.ones(7)


@pytest.mark.parametrize(("share", "cause"), [(0.48, "none"), (0.52, "transmission")])
def test_half_of_a_motion_that_is_left_is_the_transmissions(share, cause):
    """Residual over simulated motion; the paper draws the line without a number."""
    assert {gap.cause for gap in channel_gaps(WAVE, (1 - share) * WAVE, WAVE)} == {cause}


@pytest.mark.parametrize(
    ("change", "cause"), [(0.48, "none"), (0.52, "feedback"), (-0.48, "none"), (-0.52, "feedback")]
)
def test_half_of_a_motion_that_changes_in_closed_loop_is_the_feedbacks(change, cause):
    assert {gap.cause for gap in channel_gaps(WAVE, WAVE, (1 + change) * WAVE)} == {cause}


@pytest.mark.parametrize(("factor", "cause"), [(0.9, "none"), (1.1, "transmission")])
def test_what_a_hands_static_error_makes_is_no_gap(factor, cause):
    """0.2 mm of cable, 10 mrad of abduction, as standard deviations."""
    floor = np.array([2e-4] * 4 + [0.01] + [2e-4] * 2)
    still = np.zeros_like(WAVE)
    residual = factor * floor * WAVE / WAVE.std(axis=0)
    assert {gap.cause for gap in channel_gaps(still, residual, still)} == {cause}


def test_an_offset_is_the_hand_less_the_simulator():
    assert [gap.offset for gap in channel_gaps(WAVE, WAVE + 0.003, WAVE)] == pytest.approx([0.003] * 7)


def test_a_replayed_episode_is_compared_with_what_its_actions_did(monkeypatch):
    """A reading shows what the action before it did, so that the hand's second reading belongs to the first action."""
    played = np.arange(6.0)[:, None] * np.ones(7)
    free = 100.0 + played
    compared = []

    def trial(policy, unit, *, seed, settings, script, on_step):
        assert unit.name == "reference"
        for row in played if script is not None else free:
            on_step(replace_step(row))

    def replace_step(row):
        class Step:
            lengths = row

        return Step

    monkeypatch.setattr(byte_evaluation, "run_trial", trial)
    monkeypatch.setattr(byte_evaluation, "channel_gaps", lambda *traces: compared.append(traces) or ())
    byte_evaluation.open_loop_gaps(holding(), np.zeros((6, 7)), 10.0 + played, seconds=0.3, seed=0)
    simulated, replayed, closed = compared[0]
    np.testing.assert_array_equal(simulated, 10.0 + played[:5])
    np.testing.assert_array_equal(replayed, played[1:])
    np.testing.assert_array_equal(closed, free)
