import mujoco
import numpy as np
import pytest

from train import randomise
from train.simulator import build_scene

DRAWS = 10_000

SHARED = {"fingertip friction", "cube inertia"}


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return build_scene().compile()


@pytest.fixture(scope="module")
def draws(model):
    return randomise.draw(model, np.random.default_rng(0), DRAWS, randomise.table(model))


def relative(row, draws, model):
    field, index = row.where[0]
    drawn, nominal = draws[field][:, *index], getattr(model, field)[index]
    values = {"set": drawn, "shift": drawn - nominal, "scale": drawn / np.where(nominal, nominal, 1)}[row.rule]
    return values.reshape(DRAWS, -1)


@pytest.mark.parametrize("number", range(9))
def test_each_row_is_uniform_over_its_range(number, draws, model):
    row = randomise.table(model)[number]
    values = relative(row, draws, model)
    width = row.high - row.low
    assert row.low - 1e-9 <= values.min() < row.low + 0.01 * width
    assert row.high + 1e-9 >= values.max() > row.high - 0.01 * width
    np.testing.assert_allclose(values.mean(axis=0), (row.low + row.high) / 2, atol=0.02 * width)
    correlation = np.corrcoef(values.T)
    expected = np.ones_like(correlation) if row.name in SHARED else np.eye(len(correlation))
    np.testing.assert_allclose(correlation, expected, atol=0.06)


def test_nothing_else_is_randomised_in_particular_not_the_cubes_friction_and_mass(draws, model):
    cube_geom, cube = model.geom("cube").id, model.body("cube").id
    assert (draws["geom_friction"][:, cube_geom] == model.geom_friction[cube_geom]).all()
    assert (draws["body_mass"][:, cube] == model.body_mass[cube]).all()
    changed = {
        name: np.unique(np.nonzero((values != getattr(model, name)).any(axis=0))[0]) for name, values in draws.items()
    }
    np.testing.assert_array_equal(changed["qpos0"], np.arange(16))
    np.testing.assert_array_equal(changed["dof_damping"], np.arange(16))
    np.testing.assert_array_equal(changed["body_inertia"], [cube])
    np.testing.assert_array_equal(changed["body_ipos"], [cube])
    assert len(changed["geom_friction"]) == 5


def test_every_environment_gets_a_model_of_its_own(model):
    draws = randomise.draw(model, np.random.default_rng(1), 3, randomise.table(model))
    copies = randomise.models(model, draws)
    for environment, one in enumerate(copies):
        np.testing.assert_array_equal(one.dof_damping, draws["dof_damping"][environment])
    assert (copies[0].dof_damping != copies[1].dof_damping).any()
    assert model.dof_frictionloss[0] == pytest.approx(0.02)
