from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from checkpoints import POINT

from train.actuation import IDEAL, SERVOS
from train.hands import HANDS
from train.progress import (
    PICTURE,
    Standing,
    append,
    read,
    read_standing,
    write_standing,
)
from train.recipe import FAST, PAPER, RECIPES, STEADY, Goal, Stage, on_gpu
from train.task.reward import PAPER_REWARD, RewardSettings, Weights


def test_a_curve_comes_back_as_it_went_and_is_drawn(tmp_path):
    points = [POINT, replace(POINT, attempt=1, steps=0, rate_rad_s=-0.1)]
    for point in points:
        append(tmp_path, point)
    assert read(tmp_path) == points
    assert (tmp_path / PICTURE).read_bytes().startswith(b"\x89PNG")


def test_the_standing_comes_back_as_it_went(tmp_path):
    standing = Standing("steady", 3, attempt=1, steps=1000, elapsed_s=2.5, best_score=None)
    write_standing(tmp_path, standing)
    assert read_standing(tmp_path) == standing
    with pytest.raises(FileNotFoundError):
        read_standing(tmp_path / "elsewhere")


def test_the_gpu_recipe_is_the_papers():
    paper = on_gpu(PAPER)
    assert (paper.environments, paper.environments // paper.minibatches, paper.minibatches) == (8192, 256, 32)
    assert (paper.unroll, paper.epochs, paper.steps) == (40, 4, 300_000_000)
    (stage,) = paper.stages
    assert (stage.learning_rate, stage.discount, stage.entropy_cost) == (3e-4, 0.97, 1e-2)
    assert stage.rewarded == PAPER_REWARD
    assert (paper.clipping, paper.gae, paper.hidden) == (0.3, 0.95, (512, 256, 128))


def test_the_steady_recipe_has_built_hands_the_fast_one_servos_and_the_papers_neither():
    assert set(RECIPES) == {"steady", "fast", "paper"}
    assert all(stage.built > 0 and stage.actuation.counts for stage in STEADY.stages)
    assert STEADY.task_in(STEADY.stages[-1], 10).actuation.delay_s[1] >= 0.03
    assert FAST.stages[0].actuation.counts
    assert not any(stage.built for stage in FAST.stages)
    assert not any(stage.rows or stage.actuation.counts for stage in PAPER.stages)


def test_the_springs_of_the_steady_recipe_move_from_the_default_hands_past_the_recorded_ones_and_end_on_all():
    moving = [stage.hands.towards_recorded for stage in STEADY.stages if not stage.routed_rewarded]
    last = {stage.hands.towards_recorded for stage in STEADY.stages if stage.routed_rewarded}
    assert moving == sorted(moving)
    assert all(low < high_before for (_, high_before), (low, _) in pairwise(moving))
    assert (moving[0][0], moving[-1][1]) == HANDS.towards_recorded
    assert last == {HANDS.towards_recorded}


def test_on_gpus_every_hand_is_routed_and_behind_servos_where_it_was_built():
    assert not any(stage.built for stage in on_gpu(STEADY).stages)
    assert all(stage.actuation == SERVOS for stage in on_gpu(STEADY).stages)
    assert [stage.actuation for stage in on_gpu(FAST).stages] == [stage.actuation for stage in FAST.stages]


def test_on_gpus_hands_get_the_reward_of_routed_ones():
    for large, stage in zip(on_gpu(STEADY).stages, STEADY.stages, strict=True):
        assert large.rewards(8192) == (stage.routed_rewarded or stage.rewarded)


def test_a_stage_can_reward_its_routed_hands_otherwise_than_its_built_ones():
    routed = RewardSettings(Weights(airborne=-3.0), rotation_cap_rad_s=2.0, affordable=0.5)
    stage = Stage(1000, PAPER_REWARD, routed_rewarded=routed, built=0.3)
    rewards = stage.rewards(10)
    np.testing.assert_array_equal(rewards.weights.airborne, [-3.0] * 7 + [0.0] * 3)
    np.testing.assert_array_equal(rewards.rotation_cap_rad_s, [2.0] * 7 + [np.inf] * 3)
    np.testing.assert_array_equal(rewards.affordable, [0.5] * 7 + [np.inf] * 3)
    assert (stage.built_hands(10), replace(stage, routed_rewarded=None).rewards(10)) == (3, PAPER_REWARD)
    assert STEADY.stages[-1].routed_rewarded.weights.airborne < STEADY.stages[-1].rewarded.weights.airborne < 0


def test_the_last_stages_of_steady_let_turning_pay_and_reach_the_ideal_simulator():
    last = [stage for stage in STEADY.stages if stage.routed_rewarded]
    assert last == list(STEADY.stages[-len(last) :])
    assert all(0.0 < stage.routed_rewarded.affordable < 1.0 for stage in last)
    assert all(stage.actuation.delay_s[0] == 0.0 and not stage.actuation.slewed for stage in last)


def test_what_is_measured_at_the_end_of_steady_is_the_ideal_simulator():
    assert {stage.routed_measured for stage in STEADY.stages if stage.routed_rewarded} == {IDEAL}


def test_at_the_end_of_steady_a_thumb_that_gives_way_costs_built_hands():
    weights = STEADY.task_in(STEADY.stages[-1], 10).rewarded.weights
    built = STEADY.stages[-1].built_hands(10)
    assert 0 < built < 10
    np.testing.assert_array_equal(weights.pushed < 0, [False] * (10 - built) + [True] * built)


def test_steady_is_found_with_the_papers_cube_and_led_to_any_in_at_most_four_stages():
    assert len(STEADY.stages) <= 4
    assert [stage.any_cube for stage in STEADY.stages] == [False] + [True] * (len(STEADY.stages) - 1)
    assert not any(stage.any_cube for recipe in (FAST, PAPER) for stage in recipe.stages)


def test_built_hands_are_corrected_less_well_once_they_are_few():
    error = {stage.built: stage.hands.correction_error_m for stage in STEADY.stages}
    assert error[min(error)] > max(error[share] for share in error if share > min(error))


def test_the_checkpoint_that_is_kept_is_measured_on_the_most_hands():
    assert STEADY.stages[-1].measured > max(stage.measured for stage in STEADY.stages[:-1])


def test_a_stage_has_its_own_length_of_episodes():
    assert STEADY.task_in(STEADY.stages[0], 10).episode_steps == 500
    assert STEADY.task_in(STEADY.stages[-1], 10).episode_steps == STEADY.stages[-1].episode_steps < 500


def test_a_stage_without_routed_hands_is_refused():
    with pytest.raises(ValueError, match="routed"):
        Stage(1000, built=1.0)


def test_a_recipe_that_does_not_divide_is_refused():
    with pytest.raises(ValueError, match="divide"):
        replace(FAST, environments=255)


def test_the_score_is_the_rate_less_what_falls_short_of_the_goal():
    goal = Goal(survival=0.95, built_survival=0.9, airborne=0.002)
    good = {"survival": 0.98, "built_survival": 0.95, "airborne": 0.001}
    assert goal.score(1.0, **good) == 1.0
    for worse in ({"survival": 0.85}, {"built_survival": 0.80}, {"airborne": 0.012}):
        assert goal.score(1.0, **{**good, **worse}) == pytest.approx(0.5)


def test_a_short_run_still_has_checkpoints():
    assert FAST.with_steps(1_024_000).checkpoint_steps == 102_400
    assert FAST.with_steps(10_240).checkpoint_steps == 10_240
    assert FAST.with_steps(FAST.steps // 10).steps == FAST.steps // 10
