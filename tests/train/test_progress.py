from dataclasses import replace

import pytest
from checkpoints import POINT

from train.actuation import SERVOS
from train.progress import PICTURE, append, read
from train.recipe import PAPER, RECIPES, STEADY, Goal, on_gpu
from train.stage import Redraw, TrainingStage
from train.task.reward import PAPER_REWARD


def test_a_curve_comes_back_as_it_went_and_is_drawn(tmp_path):
    points = [POINT, replace(POINT, attempt=1, steps=0, rate_rad_s=-0.1)]
    for point in points:
        append(tmp_path, point)
    assert read(tmp_path) == points
    assert (tmp_path / PICTURE).read_bytes().startswith(b"\x89PNG")


def test_the_gpu_recipe_is_the_papers():
    paper = on_gpu(PAPER)
    assert (paper.environments, paper.environments // paper.minibatches, paper.minibatches) == (8192, 256, 32)
    (stage,) = paper.stages
    assert (stage.unroll, paper.epochs, paper.steps) == (40, 4, 300_000_000)
    assert (stage.learning_rate.at(0), stage.discount, stage.entropy_cost.at(0)) == (3e-4, 0.97, 1e-2)
    assert (stage.learning_rate.at(10**9), stage.entropy_cost.at(10**9)) == (3e-4, 1e-2)
    assert stage.rewarded == PAPER_REWARD
    assert (stage.clipping, paper.gae, paper.hidden) == (0.3, 0.95, (512, 256, 128))


def test_the_steady_recipe_has_built_hands_and_the_papers_none():
    assert set(RECIPES) == {"steady", "paper"}
    assert all(stage.built and stage.actuation.counts for stage in STEADY.stages)
    assert STEADY.task_in(STEADY.stages[-1]).actuation.delay_s[1] >= 0.03
    assert not any(stage.built for stage in PAPER.stages)
    assert not any(stage.rows or stage.actuation.counts for stage in PAPER.stages)


def test_the_springs_of_steady_begin_near_the_default_and_are_all_of_them_later():
    assert [stage.hands.towards_recorded for stage in STEADY.stages] == [(0.0, 0.5), (0.0, 1.1), (0.0, 1.1)]


def test_on_gpus_every_hand_is_routed_and_behind_servos_where_it_was_built():
    assert not any(stage.built for stage in on_gpu(STEADY).stages)
    assert all(stage.actuation == SERVOS for stage in on_gpu(STEADY).stages)


def test_steady_is_found_with_the_papers_cube_and_led_to_any_in_at_most_four_stages():
    assert len(STEADY.stages) <= 4
    assert [stage.any_cube for stage in STEADY.stages] == [False] + [True] * (len(STEADY.stages) - 1)
    assert not any(stage.any_cube for stage in PAPER.stages)


def test_the_last_stage_of_steady_follows_the_drops_and_weights_turning():
    last = STEADY.stages[-1]
    assert last.drop_price
    assert (last.drop_price.begin, last.drop_price.bounds, last.drop_price.hazard_per_s) == (
        100.0,
        (60.0, 400.0),
        0.005,
    )
    assert last.turning
    assert (last.redraw.every, last.redraw.hands, last.tail_share) == (20, 40, 0.5)
    assert (last.action_rate.at(0), last.action_rate.at(500_000), last.action_rate.at(2_000_000)) == pytest.approx(
        (-0.1, -0.15, -0.2)
    )
    assert last.discount == 0.985


def test_routed_hands_are_not_redrawn():
    with pytest.raises(ValueError, match="built"):
        TrainingStage("any", 1000, redraw=Redraw(20, 40))


def test_a_recipe_that_does_not_divide_is_refused():
    with pytest.raises(ValueError, match="divide"):
        replace(PAPER, environments=255)


def test_the_score_is_the_rate_less_what_falls_short_of_the_goal():
    goal = Goal(survival=0.95)
    assert goal.score(1.0, 0.98) == 1.0
    assert goal.score(1.0, 0.85) == pytest.approx(0.5)


def test_a_short_run_still_has_checkpoints():
    assert PAPER.with_steps(1_024_000).checkpoint_steps == 102_400
    assert PAPER.with_steps(10_240).checkpoint_steps == 10_240
    assert PAPER.with_steps(PAPER.steps // 10).steps == PAPER.steps // 10
