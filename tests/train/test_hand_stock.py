"""Which hands a batch holds, and that a hand is the same whoever builds it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.cubes import PROPERTIES, TAILS
from model.units.plausible import plausible_unit
from train.hand_stock import HandStock, oldest, present
from train.recipe import STEADY

STOCK = HandStock(STEADY.stages[-1], STEADY.task.settings, (3, 0, 2, 0))


@given(st.integers(1, 300), st.lists(st.integers(1, 100), max_size=8))
def test_the_oldest_hands_give_way_to_the_next_numbers(count, redraws):
    batch, new = list(range(count)), 0
    for hands in redraws:
        for place in oldest(count, new, hands):
            assert batch[place] == min(batch)
            batch[place] = count + new
            new += 1
        assert present(count, new) == batch


def test_a_hand_follows_from_its_number_alone():
    first, again, other = STOCK.hand(7), STOCK.hand(7), STOCK.hand(8)
    np.testing.assert_array_equal(first.correction, again.correction)
    np.testing.assert_array_equal(first.scene.model.body_mass, again.scene.model.body_mass)
    assert not np.allclose(first.correction, other.correction)
    elsewhere = replace(STOCK, seed=(4, 0, 2, 0)).hand(7)
    assert not np.allclose(first.correction, elsewhere.correction)


def test_the_last_stage_trains_on_healthy_hands_that_no_command_can_name(monkeypatch):
    drawn = []
    monkeypatch.setattr("train.hands.plausible_unit", lambda seed: drawn.append(seed) or plausible_unit(seed))
    monkeypatch.setattr("train.hand_stock.draw_scenes", lambda units, *_: drawn.extend(units) or [None])
    monkeypatch.setattr("train.hand_stock.corrections", lambda *_, **__: np.zeros((1, 7)))
    STOCK.hand(7)
    seed, unit = drawn
    assert seed > 4_294_967_295  # the largest `--seed`
    assert unit == plausible_unit(seed)


def share_in_a_tail(cubes):
    values = {one.name: one.change for one in PROPERTIES}
    assert set(TAILS) < set(values)
    inside = [
        TAILS["side"][0] <= cube.side_m <= TAILS["side"][1]
        or TAILS["mass"][0] <= cube.mass_kg <= TAILS["mass"][1]
        or TAILS["friction"][0] <= cube.friction <= TAILS["friction"][1]
        for cube in cubes
    ]
    return np.mean(inside)


@pytest.fixture
def seen(monkeypatch):
    """Cubes of the hands that a stock builds, without building them."""
    seen = []
    monkeypatch.setattr("train.hand_stock.draw_scenes", lambda u, r, g, t, cubes: seen.extend(cubes) or [None])
    monkeypatch.setattr("train.hand_stock.corrections", lambda *_, **__: np.zeros((1, 7)))
    return seen


@pytest.mark.parametrize(("training", "least", "most"), [(True, 1.0, 1.0), (False, 0.2, 0.95)])
def test_only_hands_to_train_on_have_cubes_from_the_tail(training, least, most, seen):
    stock = replace(STOCK, stage=replace(STOCK.stage, tail_share=1.0), training=training)
    for number in range(60):
        stock.hand(number)
    assert least <= share_in_a_tail(seen) <= most
