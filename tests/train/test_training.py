"""Training end to end, small; what runs XLA's compiler for tens of seconds is slow."""

import signal
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("brax.training.agents.ppo", reason="needs the extra `train`")

from checkpoints import POINT
from click.testing import CliRunner

from aero.policy.file import load
from hil.cli import main
from train import selection, trainer
from train.built import BuiltSimulator
from train.recipe import STEADY, Redraw
from train.run_state import (
    STATE,
    RunFolderError,
    Standing,
    Tendency,
    load_arrays,
    read_curve,
    read_standing,
    save_arrays,
)
from train.trainer import StopReason, TrainingEnd

TINY = replace(
    STEADY,
    environments=8,
    minibatches=2,
    epochs=1,
    hidden=(16,),
    stages=(
        replace(STEADY.stages[-1], unroll=5, steps=120, measured=2, frozen_updates=1, redraw=Redraw(every=2, hands=3)),
    ),
    checkpoint_steps=80,
)
"""Three updates of 40 steps; hands are replaced before the third. One stage, for XLA compiles each one anew."""
STANDING = Standing("steady", 3, attempt=1, steps=20_480, updates=7, tendency=Tendency(0.25, 0.01, 7), drop_price=120.0)


@pytest.fixture(autouse=True)
def short_episodes(monkeypatch):
    monkeypatch.setattr(trainer, "EPISODE_S", 0.5)


def trained(folder, recipe=TINY, **options):
    return trainer.train(recipe, "native", 0, folder, threads=1, **options)


def kept(folder):
    """Return every array of a run's state."""
    with np.load(folder / STATE) as archive:
        return {name: archive[name] for name in archive.files if name != "standing"}


def test_a_state_comes_back_as_it_went(tmp_path):
    arrays = {"a": np.arange(3.0, dtype=np.float32), "b": (np.uint32(7), np.zeros((2, 0)))}
    save_arrays(tmp_path / STATE, arrays, STANDING)
    assert read_standing(tmp_path) == STANDING
    again = load_arrays(tmp_path / STATE, arrays)
    np.testing.assert_array_equal(again["a"], arrays["a"])
    assert again["b"][0] == 7
    with pytest.raises(ValueError, match="another recipe"):
        load_arrays(tmp_path / STATE, {"a": np.zeros(4)})
    with pytest.raises(RunFolderError, match="holds no run yet"):
        read_standing(tmp_path / "elsewhere")


def commanded(monkeypatch, folder, *arguments, ending=StopReason.DONE, by_signal=None):
    """Run the command with a training that only tells, and return what it asked for and what it said."""
    asked = []

    def fake(recipe, backend, seed, folder, *, say, provenance, **options):
        asked.append((recipe, backend, seed, folder, options))
        assert {"mujoco", "jax", "brax"} <= provenance["versions"].keys()
        say(str(POINT))
        if ending is StopReason.TIME:
            (folder / STATE).touch()
        return TrainingEnd(ending, Standing(recipe.name, seed, steps=40_960), by_signal)

    monkeypatch.setattr(trainer, "train", fake)
    monkeypatch.setattr(selection, "choose", lambda *_, **__: None)
    result = CliRunner().invoke(main, ["train", *arguments, "--out", str(folder)], catch_exceptions=False)
    return asked[0], result


def test_the_command_asks_for_the_recipe_and_says_checkpoints_and_how_to_go_on(monkeypatch, tmp_path):
    arguments = ["paper", "--backend", "native", "--steps", "102400", "--seed", "3", "--minutes", "5", "--threads", "1"]
    (recipe, *rest), result = commanded(monkeypatch, tmp_path, *arguments, ending=StopReason.TIME)
    said = result.output
    assert result.exit_code == 0
    assert (recipe.name, recipe.steps) == ("paper", 102_400)
    assert rest == ["native", 3, tmp_path, {"minutes": 5.0, "threads": 1, "resume": False, "parameters": None}]
    assert "0.55 rad/s  keeps  97%; average  0.50 rad/s  keeps  98%" in said
    assert "the time is over: 0.04 M of 0.10 M steps, in " in said
    assert f"aero-hil train paper --seed 3 --steps 102400 --out {tmp_path} --resume" in said.replace("\n", "")


def test_a_run_from_a_checkpoint_has_the_last_stage_alone(monkeypatch, tmp_path):
    file = tmp_path / "0_0000000080.npz"
    np.savez(file, np.zeros(3))
    (recipe, *_, options), _ = commanded(monkeypatch, tmp_path / "run", "--backend", "native", "--from", str(file))
    assert recipe.stages == STEADY.stages[-1:]
    assert options["parameters"] == file


@pytest.mark.slow
def test_a_run_goes_on_from_a_checkpoint_of_another(tmp_path):
    trained(tmp_path / "first")
    file = sorted((tmp_path / "first" / "checkpoints").glob("0_*.npz"))[-1]
    trained(tmp_path / "second", parameters=file, minutes=1e-9)
    with (
        np.load(file) as archive,
        trainer.StageRun(
            trainer._TrainingRun(TINY, "native", tmp_path, 1, {}, print, lambda: None, STANDING), 0, (0,)
        ) as stage,
    ):
        begun = stage.begin(stage.learner(file)).learner.parameters
        for leaf, name in zip(trainer.jax.tree.leaves(begun), sorted(archive.files), strict=True):
            np.testing.assert_array_equal(leaf, archive[name])


@pytest.mark.parametrize(("accelerated", "environments"), [(False, STEADY.environments), (True, 8192)])
def test_mjx_without_a_gpu_says_so_and_keeps_to_the_size_for_cpus(accelerated, environments, monkeypatch, tmp_path):
    monkeypatch.setattr(trainer, "accelerated", lambda: accelerated)
    (recipe, *_), result = commanded(monkeypatch, tmp_path, "--backend", "mjx")
    assert recipe.environments == environments
    assert not any(stage.built for stage in recipe.stages)
    assert ("Warning: JAX finds no GPU" in result.output) == (not accelerated)


def test_with_a_gpu_the_command_says_that_it_trains_another_task_under_another_name(monkeypatch, tmp_path):
    monkeypatch.setattr(trainer, "accelerated", lambda: True)
    (recipe, *_), result = commanded(monkeypatch, tmp_path, "--backend", "mjx")
    assert recipe.name == "steady-routed"
    assert not any(stage.built for stage in recipe.stages)
    assert "MJX cannot step the built hands of steady. This trains another task, steady-routed" in result.output
    (paper, *_), result = commanded(monkeypatch, tmp_path, "paper", "--backend", "mjx")
    assert paper.name == "paper"
    assert "another task" not in result.output


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_run_that_a_signal_ended_has_its_exit_code_and_says_what_is_kept(number, code, monkeypatch, tmp_path):
    options = {"ending": StopReason.STOPPED, "by_signal": number}
    _, result = commanded(monkeypatch, tmp_path, "--backend", "native", **options)
    assert (result.exit_code, "Nothing is kept" in result.output) == (code, True)
    (tmp_path / STATE).touch()
    (tmp_path / "steady.npz").touch()
    _, result = commanded(monkeypatch, tmp_path, "--backend", "native", **options)
    assert result.exit_code == code
    assert f"Kept in {tmp_path}: the state, every checkpoint" in result.output.replace("\n", "")
    assert "--resume" in result.output


def test_an_epoch_is_a_line_of_what_the_hands_in_training_did(monkeypatch):
    monkeypatch.setattr(trainer, "EPISODE_S", 15.0)
    assert trainer.epoch_line("find", STANDING, 1000.0, None) == (
        "find    0.02 M steps   0.25 rad/s  keeps  86%  1.00% drops/s at 120   1000 steps/s  time left not known yet"
    )
    assert trainer.epoch_line("find", STANDING, 1000.0, 600.0).endswith("steps/s    10 min left")


def test_the_command_refuses_a_folder_that_holds_a_run(tmp_path):
    (tmp_path / STATE).touch()
    result = CliRunner().invoke(main, ["train", "--backend", "native", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "resume" in result.output


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    """A run that nothing ended before its time."""
    folder = tmp_path_factory.mktemp("unbroken")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trainer, "EPISODE_S", 0.5)
        return folder, trained(folder, provenance={"commit": "abc"})


@pytest.mark.slow
def test_a_run_leaves_a_policy_every_checkpoint_and_its_curve(unbroken):
    folder, ended = unbroken
    assert (ended.ending, ended.standing.steps, ended.standing.new_hands) == (StopReason.DONE, 120, 3)
    assert [point.steps for point in read_curve(folder)] == [80, 120]
    names = {path.name for path in (folder / "checkpoints").iterdir()}
    assert names == {f"{kind}0_{steps:010d}.npz" for kind in ("", "average_") for steps in (80, 120)}
    policy = load(folder / "steady.npz")
    assert policy.provenance["recipe_sha256"] == TINY.fingerprint != STEADY.fingerprint
    assert (policy.provenance["commit"], policy.provenance["resumes"]) == ("abc", 0)
    with pytest.raises(RunFolderError, match="resume"):
        trained(folder)
    with pytest.raises(ValueError, match="seed 0"):
        trainer.train(TINY, "native", 1, folder, resume=True)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_run_before_the_next_batch_of_physics_and_the_resumed_one_has_the_same_weights(
    number, unbroken, monkeypatch, tmp_path
):
    calls = {"physics": 0}
    advance = BuiltSimulator.advance

    def counted(self, states, controls):
        calls["physics"] += 1
        if calls["physics"] == calls.get("stop"):
            signal.raise_signal(number)
        return advance(self, states, controls)

    monkeypatch.setattr(BuiltSimulator, "advance", counted)
    calls["stop"] = int(np.random.default_rng(int(number)).integers(9, 24))  # eight prepare the starts, 15 are acted in
    ended = trained(tmp_path)
    assert (ended.ending, ended.by_signal, calls["physics"]) == (StopReason.STOPPED, number, calls["stop"])
    assert ended.standing.steps == 40 * ((calls["stop"] - 9) // 5)
    calls["stop"] = -1
    assert trained(tmp_path, resume=True).ending is StopReason.DONE
    expected, found = kept(unbroken[0]), kept(tmp_path)
    assert expected.keys() == found.keys()
    for name, array in expected.items():
        np.testing.assert_array_equal(found[name], array)
    assert [point.steps for point in read_curve(tmp_path)] == [80, 120]


@pytest.mark.slow
def test_the_last_checkpoints_and_the_average_are_ranked_on_other_hands(unbroken, monkeypatch):
    folder, ended = unbroken
    monkeypatch.setattr(selection, "HELD_OUT", 3)
    monkeypatch.setattr(selection, "EPISODE_S", 0.5)
    told = []
    found = selection.ranked(TINY, folder, ended.standing, threads=1, say=told.append)
    assert [line.split(":")[0].strip() for line in told] == ["0_0000000080", "0_0000000120", "average_0_0000000120"]
    bounds = [one.bound_rad_s for one in found]
    assert bounds == sorted(bounds, reverse=True)
    (average,) = [one.policy.provenance for one in found if one.name.startswith("average")]
    assert (average["commit"], average["steps"], average["averaged"]) == ("abc", 120, True)


@pytest.mark.slow
def test_a_run_that_holds_the_cube_still_is_begun_again_with_another_seed(tmp_path):
    def enough(line):
        if "attempt 1" in line:
            raise KeyboardInterrupt

    hopeless = replace(TINY, stuck_steps=80, stuck_rate_rad_s=1e3)
    with pytest.raises(KeyboardInterrupt):
        trained(tmp_path, hopeless, say=enough)
    first, second = read_curve(tmp_path)
    assert [(point.attempt, point.steps) for point in (first, second)] == [(0, 80), (1, 80)]
    assert first.score != second.score


@pytest.mark.slow
def test_a_run_stops_at_its_time_and_says_where_it_stands(tmp_path):
    ended = trained(tmp_path, minutes=1e-6)
    assert (ended.ending, ended.standing.steps) == (StopReason.TIME, 0)
