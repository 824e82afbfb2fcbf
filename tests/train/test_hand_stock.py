"""Which hands a batch holds, and that a hand is the same whoever builds it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.cubes import PROPERTIES, TAILS, any_cube, nearer, tail_cube
from model.scene import CUBE
from model.units.plausible import plausible_unit
from train.hand_stock import HandStock, oldest, present
from train.recipe import STEADY
from train.stage import TrainingStage

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


def test_a_routed_stage_has_no_healthy_hands():
    with pytest.raises(ValueError, match="healthy"):
        TrainingStage("routed", 1, healthy=True)


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


def test_a_cube_from_the_tail_has_one_property_from_it_and_all_within_what_people_have():
    rng = np.random.default_rng(0)
    cubes = [tail_cube(rng) for _ in range(300)]
    assert share_in_a_tail(cubes) == 1.0
    assert all(0.045 <= cube.side_m <= 0.055 and 0.040 <= cube.mass_kg <= 0.140 for cube in cubes)
    assert all(0.3 <= cube.friction <= 1.0 for cube in cubes)
    for name, (low, high) in {"side_m": (0.052, 0.055), "mass_kg": (0.110, 0.140), "friction": (0.8, 1.0)}.items():
        assert np.mean([low <= getattr(cube, name) <= high for cube in cubes]) > 1 / 3
    assert 0.4 < share_in_a_tail([any_cube(rng) for _ in range(300)]) < 0.8


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


def distances(cubes):
    return np.array([abs(cube.side_m - CUBE.side_m) / 0.005 for cube in cubes])


@pytest.mark.parametrize(("training", "most"), [(True, 0.3), (False, 1.0)])
def test_only_cubes_to_train_on_are_nearer_to_the_papers(training, most, seen):
    stock = replace(STOCK, stage=replace(STOCK.stage, tail_share=0.0, cube_reach=(0.0, 0.3)), training=training)
    for number in range(60):
        stock.hand(number)
    assert most / 2 < distances(seen).max() <= most


@given(st.integers(0, 1000), st.floats(0.0, 1.0))
def test_a_nearer_cube_lies_on_the_way_to_the_papers(seed, share):
    cube = any_cube(np.random.default_rng(seed))
    near = nearer(cube, share)
    for name in ("side_m", "mass_kg", "friction", "centre_of_mass_m"):
        there, here, paper = (np.array(getattr(one, name)) for one in (cube, near, CUBE))
        np.testing.assert_allclose(here - paper, share * (there - paper), atol=1e-12)
    assert nearer(cube, 0.0) == CUBE
