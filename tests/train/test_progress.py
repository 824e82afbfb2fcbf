from dataclasses import replace

import pytest

pytest.importorskip("jax", reason="needs the extra `train`")

from checkpoints import POINT

from train.recipe import PAPER, Goal, Redraw, TrainingStage
from train.run_state import PICTURE, append, read_curve


def test_a_curve_comes_back_as_it_went_and_is_drawn(tmp_path):
    points = [POINT, replace(POINT, attempt=1, steps=0, rate_rad_s=-0.1)]
    for point in points:
        append(tmp_path, point)
    assert read_curve(tmp_path) == points
    assert (tmp_path / PICTURE).read_bytes().startswith(b"\x89PNG")


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
