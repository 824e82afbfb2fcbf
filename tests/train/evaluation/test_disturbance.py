"""Gravity off its axis, a shove and a jolt: what reaches the physics, and when."""

import numpy as np
import pytest

from model.cube_plant import GAP_M, CubePlant
from model.units import load_unit
from train.evaluation.cube_trial import JOLT_S, NONE, SHOVED_AT_S, Disturbance, Disturber


@pytest.fixture
def plant():
    return CubePlant(load_unit("reference").hand)


def test_nothing_happens_without_a_disturbance(plant):
    before = plant.gravity_m_s2
    disturber = Disturber(plant, NONE, seed=3)
    for t in np.arange(0.0, 10.0, 0.05):
        disturber.act(t)
        np.testing.assert_array_equal(plant.gravity_m_s2, before)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_gravity_is_as_strong_and_as_far_off_as_is_asked_for(plant, seed):
    before = plant.gravity_m_s2
    Disturber(plant, Disturbance(tilt_rad=np.radians(20.0)), seed)
    cosine = plant.gravity_m_s2 @ before / (before @ before)
    assert np.linalg.norm(plant.gravity_m_s2) == pytest.approx(9.81)
    assert np.degrees(np.arccos(cosine)) == pytest.approx(20.0)


def test_a_jolt_is_horizontal_and_lasts_a_tenth_of_a_second(plant):
    before = plant.gravity_m_s2
    disturber, felt = Disturber(plant, Disturbance(jolt_m_s2=5.0), seed=0), []
    times = np.arange(200) / 20.0
    for t in times:
        disturber.act(t)
        felt.append(plant.gravity_m_s2 - before)
    strength = np.linalg.norm(felt, axis=1)
    jolted = (times >= SHOVED_AT_S) & (times < SHOVED_AT_S + JOLT_S)
    np.testing.assert_allclose(strength, 5.0 * jolted, atol=1e-12)
    assert jolted.sum() == 2
    np.testing.assert_array_equal(np.array(felt)[:, 2], 0.0)


def test_a_shove_comes_once(plant, monkeypatch):
    shoves = []
    monkeypatch.setattr(plant, "shove_cube", lambda by: shoves.append(np.linalg.norm(by)))
    disturber = Disturber(plant, Disturbance(shove_m_s=0.2), seed=0)
    for t in np.arange(200) / 20.0:
        disturber.act(t)
    assert shoves == [pytest.approx(0.2)]


def test_a_shoved_cube_has_that_velocity(plant):
    plant.place_cube((1.0, 0.0, 0.0))
    plant.shove_cube((0.2, 0.0, 0.0))
    plant.advance_to(0.1)
    assert plant.cube_position()[0] == pytest.approx(1.02, abs=1e-4)


def test_a_cube_is_clear_of_the_hand_only_where_nothing_is_near(plant):
    plant.place_cube((0.08, 0.0, 0.05))
    plant.advance_to(0.002)
    assert plant.cube_clear(GAP_M)
    assert not plant.cube_clear(1.0)
    plant.advance_to(0.15)
    assert plant.cube_touched()  # it has dropped onto the open hand
    assert not plant.cube_clear(GAP_M)
