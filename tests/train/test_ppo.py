"""Training end to end, small; slow because XLA compiles for tens of seconds."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("brax.training.agents.ppo", reason="needs the extra `train`")

from checkpoints import EPISODES, POINT
from click.testing import CliRunner
from policies import policy

from aero.policy.file import load
from hil.cli import main
from train import ppo
from train.actuation import IDEAL
from train.built import BuiltSimulator
from train.evaluation.rollouts import run
from train.ppo import judged
from train.progress import Checkpoint, read, read_standing
from train.recipe import STEADY, Goal, Stuck
from train.simulator import Simulator

TINY = replace(
    STEADY,
    environments=8,
    minibatches=2,
    unroll=5,
    epochs=1,
    hidden=(16,),
    stages=tuple(replace(stage, steps=80, measured=2) for stage in STEADY.stages[1:3]),
    checkpoint_steps=80,
)


@pytest.fixture(autouse=True)
def short_episodes(monkeypatch):
    monkeypatch.setattr(ppo, "EPISODE_S", 0.5)


def test_the_command_asks_for_the_recipe_and_says_every_checkpoint(monkeypatch, tmp_path):
    asked = []

    def fake(recipe, backend, seed, folder, *, minutes, resume, provenance, on_checkpoint):
        asked.append((recipe.name, recipe.steps, backend, seed, folder, minutes, resume))
        assert {"mujoco", "jax", "brax"} <= provenance["versions"].keys()
        on_checkpoint(POINT)
        return policy()

    monkeypatch.setattr(ppo, "train", fake)
    arguments = ["train", "fast", "--backend", "native", "--steps", "102400", "--seed", "3", "--minutes", "5"]
    result = CliRunner().invoke(main, [*arguments, "--out", str(tmp_path)], catch_exceptions=False)
    assert asked == [("fast", 102_400, "native", 3, tmp_path, 5.0, False)]
    assert "keeps  97%" in result.output
    assert "0.20 M steps" in result.output


@pytest.mark.parametrize(("accelerated", "environments"), [(False, STEADY.environments), (True, 8192)])
def test_mjx_without_a_gpu_says_so_and_keeps_to_the_size_for_cpus(accelerated, environments, monkeypatch, tmp_path):
    asked = []

    def fake(recipe, *_, **__):
        asked.append(recipe)
        return policy()

    monkeypatch.setattr(ppo, "accelerated", lambda: accelerated)
    monkeypatch.setattr(ppo, "train", fake)
    result = CliRunner().invoke(main, ["train", "--backend", "mjx", "--out", str(tmp_path)], catch_exceptions=False)
    assert [recipe.environments for recipe in asked] == [environments]
    assert not any(stage.built for stage in asked[0].stages)
    assert [line.startswith("Warning: JAX finds no GPU") for line in result.output.splitlines()].count(True) == (
        not accelerated
    )


def test_the_command_refuses_a_folder_that_holds_a_run(tmp_path):
    (tmp_path / "parameters.npz").touch()
    result = CliRunner().invoke(main, ["train", "--backend", "native", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "resume" in result.output


CALM = replace(EPISODES, kept=np.array([True, True]), rotation_rad=np.array([5.0, 2.5]), airborne=np.zeros(2))
"""On other hands the same policy keeps both cubes, turns them at a third of the rate and never throws one."""


@pytest.mark.parametrize(
    ("hands", "rate", "survival", "airborne", "lost"),
    [
        ((EPISODES, None), 1.5, 0.5, 0.1, 0.4),
        ((EPISODES, CALM), 1.0, 0.75, 0.1, 0.4),
        ((CALM, EPISODES), 1.0, 0.75, 0.0, 0.3),
        ((CALM, CALM), 0.5, 1.0, 0.0, 0.0),
    ],
)
def test_a_checkpoint_is_judged_by_the_rate_on_all_hands_the_cubes_of_each_kind_and_the_routed_ones_bouncing(
    hands, rate, survival, airborne, lost
):
    goal = Goal(survival=0.9, built_survival=0.8, survival_price=3.0, airborne=0.05, airborne_price=2.0)
    point = judged(*hands, goal, attempt=0, steps=10, elapsed_s=1.0, steps_per_s=10.0)
    assert (point.rate_rad_s, point.survival) == (pytest.approx(rate), survival)
    assert point.airborne == pytest.approx(airborne)
    assert point.score == pytest.approx(rate - 3.0 * lost - 2.0 * max(0.0, airborne - 0.05))


@pytest.mark.slow
def test_a_run_leaves_a_policy_and_can_go_on(tmp_path):
    told: list[Checkpoint] = []
    policy = ppo.train(TINY, "native", 0, tmp_path, threads=1, provenance={"commit": "abc"}, on_checkpoint=told.append)
    assert [point.steps for point in told] == [0, 80, 160]
    assert read(tmp_path) == told
    assert policy.trained_delay_s == TINY.stages[1].actuation.delay_s
    assert policy.provenance["recipe"] == "steady"
    assert policy.provenance["recipe_sha256"] == TINY.fingerprint != STEADY.fingerprint
    assert (policy.provenance["commit"], policy.provenance["resumes"]) == ("abc", 0)
    assert read_standing(tmp_path).processor_s > 0
    with pytest.raises(FileExistsError, match="resume"):
        ppo.train(TINY, "native", 0, tmp_path)
    with pytest.raises(ValueError, match="seed 0"):
        ppo.train(TINY, "native", 1, tmp_path, resume=True)
    longer = (*TINY.stages, TINY.stages[1])
    more = ppo.train(replace(TINY, stages=longer), "native", 0, tmp_path, threads=1, resume=True)
    assert [point.steps for point in read(tmp_path)] == [0, 80, 160, 240]
    assert (read_standing(tmp_path).steps, read_standing(tmp_path).resumes) == (240, 1)
    assert more.provenance["resumes"] == 1
    observation = policy.network.mean
    np.testing.assert_array_equal(load(tmp_path / "steady.npz").network.act(observation), more.network.act(observation))


@pytest.mark.slow
def test_a_run_that_does_not_get_going_is_begun_again_with_another_seed(tmp_path):
    told: list[Checkpoint] = []

    def enough(point: Checkpoint) -> None:
        told.append(point)
        if point.attempt == 2:
            raise KeyboardInterrupt

    hopeless = replace(TINY, stuck=Stuck(steps=80, rate_rad_s=1e3))
    with pytest.raises(KeyboardInterrupt):
        ppo.train(hopeless, "native", 0, tmp_path, threads=1, on_checkpoint=enough)
    assert [(point.attempt, point.steps) for point in told] == [(0, 0), (0, 80), (1, 0), (1, 80), (2, 0)]
    assert told[0].score != told[2].score


@pytest.mark.slow
def test_each_kind_of_hand_is_measured_as_the_stage_says(monkeypatch, tmp_path):
    seen = []

    def spy(policy, task, batch, seconds, seed):
        seen.append((type(batch), task.actuation))
        return run(policy, task, batch, seconds, seed)

    monkeypatch.setattr(ppo, "run", spy)
    stage = replace(TINY.stages[0], routed_measured=IDEAL)
    ppo.train(replace(TINY, stages=(stage,)), "native", 0, tmp_path, minutes=1e-3, threads=1)
    assert seen == [(Simulator, IDEAL), (BuiltSimulator, stage.actuation)]
    assert stage.actuation != IDEAL


@pytest.mark.slow
def test_a_run_stops_at_its_time(tmp_path):
    told: list[Checkpoint] = []
    ppo.train(TINY, "native", 0, tmp_path, minutes=1e-3, threads=1, on_checkpoint=told.append)
    assert len(told) == 1


@pytest.mark.slow
def test_a_run_that_got_going_is_not_given_up_when_it_is_resumed(tmp_path):
    short = replace(TINY, stages=TINY.stages[:1])
    ppo.train(short, "native", 0, tmp_path, threads=1)
    told: list[Checkpoint] = []
    strict = replace(TINY, stuck=Stuck(steps=80, rate_rad_s=1e3))
    ppo.train(strict, "native", 0, tmp_path, threads=1, resume=True, on_checkpoint=told.append)
    assert [(point.attempt, point.steps) for point in told] == [(0, 160)]
