"""Which hands a batch holds, and that a hand is the same whoever builds it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import CABLES
from aero.policy.running import typical_correction
from model.units.plausible import plausible_unit
from train.hand_stock import HandStock, next_slots, present
from train.recipe import STEADY
from train.simulator import build_scene
from train.task import HAND_FACTS

MODEL = build_scene().compile()


def scene():
    """A hand that was not built, whose fingertips can be given a friction."""
    return SimpleNamespace(model=MODEL)


STOCK = HandStock(STEADY.stages[-1], STEADY.task.settings, (3, 0, 2, 0))


@given(st.integers(1, 300), st.lists(st.integers(1, 100), max_size=8))
def test_the_oldest_hands_give_way_to_the_next_numbers(count, redraws):
    batch, new = list(range(count)), 0
    for hands in redraws:
        for place in next_slots(count, new, hands):
            assert batch[place] == min(batch)
            batch[place] = count + new
            new += 1
        assert present(count, new) == batch


def test_the_last_stage_trains_on_healthy_hands_that_no_command_can_name(monkeypatch):
    drawn = []
    monkeypatch.setattr("train.hands.plausible_unit", lambda seed: drawn.append(seed) or plausible_unit(seed))
    monkeypatch.setattr("train.built.build_scene", lambda unit, *_: drawn.append(unit) or scene())
    monkeypatch.setattr("train.hand_stock.training_correction", lambda *_: np.zeros(7))
    STOCK.hand(7)
    seed, unit = drawn
    assert seed > 4_294_967_295  # the largest `--seed`
    assert unit == plausible_unit(seed)


@pytest.mark.parametrize("error_m", [0.0, 0.001])
@pytest.mark.parametrize("typical", [True, False])
def test_a_correction_is_about_as_wrong_as_it_says_and_the_critic_knows_by_how_much(monkeypatch, error_m, typical):
    exact = 1e-3 * np.arange(7.0)
    monkeypatch.setattr("train.built.build_scene", lambda *_: scene())
    monkeypatch.setattr("train.hand_stock.training_correction", lambda *_: exact)
    stage = replace(STOCK.stage, typical=typical, hands=replace(STOCK.stage.hands, correction_error_m=error_m))
    made = [HandStock(stage, STEADY.task.settings, (0,)).hand(number) for number in range(50)]
    corrections = np.array([one.correction for one in made])
    off = corrections - (typical_correction() if typical else exact)
    assert np.abs(off).max() <= error_m + 1e-12
    assert np.abs(off[:, list(CABLES)]).max() >= 0.9 * error_m
    np.testing.assert_allclose([one.facts[-6:] for one in made], (corrections - exact)[:, list(CABLES)])
    assert {one.facts.shape for one in made} == {(HAND_FACTS,)}


@pytest.fixture
def seen(monkeypatch):
    """Cubes of the hands that a stock builds, without building them."""
    seen = []
    monkeypatch.setattr("train.built.build_scene", lambda _unit, _limit, cube: seen.append(cube) or scene())
    monkeypatch.setattr("train.hand_stock.training_correction", lambda *_: np.zeros(7))
    return seen
