"""Policies through the bytes: the experiment, the trial with a cube, and their commands."""

import json
import pickle
import re
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from policies import holding, policy
from recorded import policy_of

from aero.policy.file import save
from aero.policy.limits import Ending, RunLimits
from aero.policy.loop import actions_on
from aero.policy.running import RunSettings
from aero.policy.settings import PAPER_TRAINING
from aero.policy.shipped import find_policy
from aero.safety import Thresholds
from hil.cli import main
from hil.cli.evaluate import OTHER_CUBES
from hil.lab.policies.cube_trial import Surroundings, run_trial
from hil.recordings.mcap_file import read_recording
from hil.targets.opening import open_target
from model.cube_plant import CubePlant
from model.units import load_unit
from model.units.cable_correction import correction

SHORT = RunSettings(seconds=1.0, approach_s=0.5, wait_s=0.2)


@pytest.fixture
def path(tmp_path):
    save(policy(), tmp_path / "policy.npz")
    return tmp_path / "policy.npz"


def test_a_policy_runs_through_every_byte_and_its_recording_replays():
    with open_target("emulated") as target:
        result, recording = policy_of(target, policy(), SHORT)
    assert result.run.ending is Ending.TIME
    assert result.run.steps == 20
    assert max(result.lateness_s) == 0.0
    assert set(recording.series) == {"codes", "hand", "action", "goal", "command_codes", "currents"}
    np.testing.assert_array_equal(actions_on(policy(), recording["hand"].values), recording["action"].values)
    np.testing.assert_allclose(np.diff(recording["hand"].times), 0.05)
    assert len(recording.wire) > 3 * 20
    assert [event.text for event in recording.events][-1] == Ending.TIME.value


def test_a_rehearsal_is_recorded_and_replays_too():
    settings = replace(SHORT, rehearsal_s=1.0, limits=RunLimits(grip_window_s=0.5))
    told = []
    with open_target("emulated") as target:
        _, recording = policy_of(target, policy(), settings, progress=lambda *said: told.append(said))
    before, after = recording["rehearsal_hand"], recording["hand"]
    assert (len(before.times), before.columns, before.units) == (20, after.columns, after.units)
    assert before.times[-1] < after.times[0]
    for prefix in ("rehearsal_", ""):
        actions = actions_on(policy(), recording[f"{prefix}hand"].values)
        np.testing.assert_array_equal(actions, recording[f"{prefix}action"].values)
    assert (0.5, "rehearsal, leave the hand empty") in told


def test_two_runs_are_the_same_to_the_bit():
    recordings = []
    for _ in range(2):
        with open_target("emulated", seed=4) as target:
            recordings.append(policy_of(target, policy(), SHORT)[1])
    assert recordings[0].wire == recordings[1].wire


def test_a_dry_run_sends_no_position():
    with open_target("emulated") as target:
        _, recording = policy_of(target, policy(), RunSettings(seconds=0.5, dry=True))
    assert {record.data[0] for record in recording.wire if record.direction == "to_hand"} <= {0x22, 0x24, 0x25}


def test_a_trial_follows_the_cube_from_its_placing():
    trial = run_trial(policy(), load_unit("reference"), seed=1, settings=SHORT)
    assert trial.run.steps > 10
    assert 0.0 < trial.alive_s <= 1.0
    assert np.isfinite(trial.rotation_rad)
    assert trial == run_trial(policy(), load_unit("reference"), seed=1, settings=SHORT)


@pytest.mark.parametrize("side", ["right", "left"])
def test_either_hand_turns_the_cube_its_own_way(side, plants):
    """The model is mirrored, so a left hand turns it clockwise; a trial counts both as forward."""
    steady, unit = find_policy("steady"), load_unit("paper")
    settings = RunSettings(seconds=2.0, correction=tuple(correction(unit, steady.settings)))
    trial = run_trial(steady, unit, settings=settings, surroundings=Surroundings(side=side))
    assert (trial.surroundings.side, trial.kept) == (side, True)
    assert trial.rotation_rad > 1.0
    assert (plants[0].cube_rotation > 1.0) is (side == "right")
    assert (plants[0].cube_rotation < -1.0) is (side == "left")


@pytest.mark.parametrize("unit", ["reference", "paper"])
def test_a_hand_that_holds_the_nominal_grasp_keeps_the_cube(unit):
    trial = run_trial(policy(), load_unit(unit), settings=RunSettings(seconds=2.0), script=np.zeros((40, 7)))
    assert trial.run.ending is Ending.TIME, trial.run.reason
    assert trial.kept
    assert trial.airborne == 0.0


def test_a_hand_that_opens_has_not_kept_the_cube():
    opening = np.tile([1.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0], (60, 1))
    trial = run_trial(policy(), load_unit("reference"), settings=RunSettings(seconds=3.0), script=opening)
    assert trial.run.ending is Ending.TIME
    assert not trial.kept
    assert trial.alive_s < 2.5


def test_a_run_that_the_guard_ended_has_not_kept_the_cube():
    thresholds = Thresholds(current_a=0.5, current_s=0.2)
    script = np.zeros((20, 7))
    trial = run_trial(policy(), load_unit("reference"), settings=SHORT, thresholds=thresholds, script=script)
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

    monkeypatch.setattr("hil.lab.policies.cube_trial.CubePlant", Watched)
    return made


def test_travel_is_that_of_the_time_in_which_the_cube_was_held(plants):
    """The index goes to and fro by 2 mm a period; after 10 of 40 periods the cube is gone."""
    seen = []

    def take_away(step):
        seen.append(step)
        if len(seen) == 10:
            plants[0].place_cube((0.0, 0.0, -1.0))

    script = np.zeros((40, 7))
    script[::2, 0] = 0.1
    trial = run_trial(
        policy(), load_unit("reference"), settings=replace(SHORT, seconds=2.0), script=script, on_step=take_away
    )
    assert not trial.kept
    assert trial.alive_s == pytest.approx(0.5, abs=0.11)
    assert trial.travel_per_s[0] == pytest.approx(0.1 * PAPER_TRAINING.scale[0] / 0.05, rel=0.15)


def test_time_in_the_air_counts_once_the_cube_has_settled(plants):
    """The first 10 of 40 periods are for settling; from the 25th on the cube falls from far above."""
    seen = []

    def lift(step):
        seen.append(step)
        if len(seen) == 25:
            plants[0].place_cube((0.11, 0.0, 50.0))

    trial = run_trial(
        policy(),
        load_unit("reference"),
        settings=replace(SHORT, seconds=2.0),
        script=np.zeros((40, 7)),
        on_step=lift,
    )
    assert trial.airborne == pytest.approx(15 / 30, abs=0.05)


def test_a_cube_that_is_taken_away_ends_a_run_that_was_rehearsed(plants):
    seen = []

    def take_away(step):
        seen.append(step)
        if len(seen) == 90:
            plants[0].place_cube((1.0, 0.0, 0.0))

    unit, steady = load_unit("reference"), find_policy("steady")
    settings = RunSettings(seconds=10.0, rehearsal_s=5.0, correction=tuple(correction(unit, steady.settings)))
    trial = run_trial(steady, unit, settings=settings, on_step=take_away)
    assert trial.run.ending is Ending.LOST
    assert 90 < trial.run.steps <= 90 + 50


def test_run_policy_prints_and_records(path, tmp_path):
    arguments = ["run-policy", str(path), "--empty", "--seconds", "1", "--record", str(tmp_path / "run.mcap")]
    result = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    assert "the time was over" in result.output
    assert read_recording(tmp_path / "run.mcap").header.experiment == "policy"


def test_run_policy_puts_a_cube_into_the_emulated_hand_and_says_how_far_it_turned(tmp_path):
    save(holding(), tmp_path / "still.npz")
    with_cube, empty = (
        CliRunner().invoke(main, ["run-policy", str(tmp_path / "still.npz"), "--seconds", "1", *more]).output
        for more in ([], ["--empty"])
    )
    assert re.search(r"cube turned\D+\d+\.\d\d rad in 1\.0 s", with_cube)
    assert "cube at the end" in with_cube
    assert "cube" not in empty


def test_run_policy_without_an_object_says_that_it_is_lost(tmp_path):
    save(holding(), tmp_path / "still.npz")
    result = CliRunner().invoke(
        main, ["run-policy", str(tmp_path / "still.npz"), "--seconds", "6", "--rehearse", "4", "--empty"]
    )
    assert result.exit_code == 1
    assert "draws as little as" in result.output


def test_run_policy_says_how_the_preset_differs_from_the_training(path):
    result = CliRunner().invoke(main, ["run-policy", str(path), "--seconds", "0.2", "--settings", "deployment"])
    assert result.exit_code == 0, result.output
    assert "nominal: trained" in result.output


def test_run_policy_ends_with_one_when_a_limit_ends_it(path):
    result = CliRunner().invoke(main, ["run-policy", str(path), "--seconds", "3", "--max-current", "0.5"])
    assert result.exit_code == 1
    assert "drawn more than 0.5 A" in " ".join(result.output.split())


def test_run_policy_does_not_begin_on_a_hand_that_must_not_be_moved(path):
    result = CliRunner().invoke(main, ["run-policy", str(path), "--seconds", "3", "--max-current", "0.001"])
    assert result.exit_code == 4
    assert "not moved" in result.output


@pytest.mark.parametrize("arguments", [["--max-current", "-1"], ["--unit", "unknown"], ["--wait", "nan"]])
def test_run_policy_refuses_what_cannot_be(path, arguments):
    result = CliRunner().invoke(main, ["run-policy", str(path), *arguments])
    assert result.exit_code == 2


def test_run_policy_refuses_a_file_that_is_no_policy(tmp_path):
    (tmp_path / "x.npz").write_bytes(b"x")
    result = CliRunner().invoke(main, ["run-policy", str(tmp_path / "x.npz")])
    assert result.exit_code == 2
    assert "convert-policy" in result.output


@pytest.mark.slow
def test_evaluate_leaves_figures_for_each_backend(path, tmp_path):
    arguments = ["evaluate", str(path), "--episodes", "2", "--trials", "1", "--units", "1", "--seconds", "0.5"]
    result = CliRunner().invoke(main, [*arguments, "--out", str(tmp_path)], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "cubes.png").stat().st_size > 10_000
    results = json.loads((tmp_path / "evaluation.json").read_text())["results"]
    assert set(results) == {"plain MuJoCo", "built hands in process", "every byte", OTHER_CUBES}
    assert {"reference", "paper", "random units (1)", "paper, firmware pre", "reference, firmware 0.1.0"} <= set(
        results["every byte"]
    )
    assert (tmp_path / "delay.png").exists()


def test_convert_policy_refuses_a_pickle_that_runs_something(tmp_path):
    (tmp_path / "evil").write_bytes(pickle.dumps(print))
    result = CliRunner().invoke(main, ["convert-policy", str(tmp_path / "evil"), str(tmp_path / "out.npz")])
    assert result.exit_code == 2
    assert "do not trust" in result.output
    assert not (tmp_path / "out.npz").exists()
