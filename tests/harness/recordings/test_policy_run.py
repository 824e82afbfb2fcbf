"""A policy as an experiment: its recording, and the command `run-policy`."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from own_policies import write_factory, write_onnx
from policies import actions_on, holding, policy
from recorded import policy_of

from aero.policy.file import save
from aero.policy.running import Ending, RunSettings
from aero.policy.shipped import find_policy
from hil.cli import main
from hil.emulated.any_hand import open_target
from hil.recordings.mcap_file import read_recording
from hil.recordings.policy_run import record_policy
from hil.recordings.recorder import Recorder
from model.cube_plant import CubeWatch
from simulator.scene import CUBE

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


def test_a_dry_run_sends_no_position():
    with open_target("emulated") as target:
        _, recording = policy_of(target, policy(), RunSettings(seconds=0.5, dry=True))
    assert {record.data[0] for record in recording.wire if record.direction == "to_hand"} <= {0x22, 0x24, 0x25}


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


@pytest.fixture(scope="module")
def long_cables(tmp_path_factory):
    """Return the unit file of a hand with a long index cable and a short ring cable."""
    file = tmp_path_factory.mktemp("unit") / "long.toml"
    rows = (0.0025, 0.0, -0.002, 0.0, 0.0, -0.0033, -0.0003)
    file.write_text(f'description = "wrong cables"\nlike = "reference"\n[hand]\ncable_take_up = {[*rows]}\n')
    return file


def test_run_policy_measures_the_cables_of_a_free_hand_first(path, long_cables, tmp_path):
    options = ["--unit", str(long_cables), "--seconds", "0.5", "--record", str(tmp_path / "run.mcap")]
    result = CliRunner().invoke(main, ["run-policy", str(path), *options], catch_exceptions=False)
    said = " ".join(result.output.split())
    assert result.exit_code == 0, result.output
    assert "keep the hand free until it asks for the object" in said
    assert re.search(r"Ring: \+\d\.\d mm within \d\.\d, unsure, from its closed stop\.", said)
    recording = read_recording(tmp_path / "run.mcap")
    correction = recording.header.parameters
    assert correction["correction"] == "measured"
    assert correction["correction_index"] == pytest.approx(-2.5e-3, abs=5e-4)
    assert correction["correction_ring"] == pytest.approx(2e-3, abs=1e-3)
    assert {"cable_wanted", "cable_travel", "cable_currents"} <= set(recording.series)
    assert sum(event.text.startswith("cable ") for event in recording.events) == 6


@pytest.mark.parametrize("how", [["--dry-run"], ["--correction", "typical"]])
def test_a_dry_run_or_a_named_correction_measures_nothing(path, how):
    said = CliRunner().invoke(main, ["run-policy", str(path), "--seconds", "0.5", "--empty", *how]).output
    assert "Correction of the cables: typical" in said
    assert "measured first" not in said


@pytest.fixture
def weak(tmp_path, monkeypatch):
    """Names an emulated hand that may draw as much as is asked."""
    monkeypatch.chdir(tmp_path)

    def named(most_a):
        Path("hands.toml").write_text(f'[weak]\nport = "emulated"\nthresholds = {{ current_a = {most_a} }}\n')
        return ["--hil", "weak"]

    return named


def test_run_policy_ends_with_4_when_the_guard_stops_the_hand(path, weak):
    result = CliRunner().invoke(main, ["run-policy", str(path), "--seconds", "3", *weak(0.5)])
    assert result.exit_code == 4
    assert "drawn more than 0.5 A" in " ".join(result.output.split())


def test_run_policy_does_not_begin_on_a_hand_that_must_not_be_moved(path, weak):
    result = CliRunner().invoke(main, ["run-policy", str(path), "--seconds", "3", *weak(0.001)])
    assert result.exit_code == 4
    assert "not moved" in result.output


def test_a_recorded_policy_limits_a_guarded_hand_as_it_was_trained():
    one = replace(holding(), settings=replace(holding().settings, torque_limit=0.5))
    with open_target(guarded=True) as target:
        recorder = Recorder(target, "policy")
        record_policy(target, recorder, one, SHORT)
        recording = recorder.finish()
        limits = [servo.memory.get("goal_torque") for servo in target.truth.electronics.servos]
    assert recording.header.parameters["torque_limit"] == 0.5
    assert limits == [500] * 7


def test_the_same_policy_as_onnx_and_as_python_through_the_bytes(tmp_path, monkeypatch):
    """Actions to 1e-6 for 1.5 s; later contacts amplify the last digit."""
    monkeypatch.chdir(tmp_path)
    names = ["steady", write_onnx(tmp_path), write_factory(tmp_path, "policy_through_the_bytes")]
    runs = []
    for name in names:
        with open_target("emulated", seed=3, cube=CUBE, guarded=True) as target:
            recorder, cube = Recorder(target, "policy"), CubeWatch(target.truth.plant, 3)
            record_policy(target, recorder, find_policy(name), RunSettings(seconds=3.0), cube=cube)
            runs.append((recorder.finish()["action"].values, cube.rotation_rad))
    for actions, turned in runs[1:]:
        np.testing.assert_allclose(actions[:30], runs[0][0][:30], atol=1e-6)
        assert turned > 0.5
    assert runs[0][1] > 0.5


@pytest.mark.parametrize(
    ("name", "said"), [("nowhere.onnx", "no policy"), ("nowhere:make", "cannot be loaded: ModuleNotFoundError")]
)
def test_run_policy_refuses_a_policy_that_is_not_there_in_one_line(name, said):
    result = CliRunner().invoke(main, ["run-policy", name])
    assert result.exit_code == 2
    assert said in result.output.splitlines()[-1]
