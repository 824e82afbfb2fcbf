import mujoco
import numpy as np
import pytest

from model.cube_plant import GAP_M, CubePlant
from model.plant import BuiltHandPlant
from model.units import load_unit
from simulator.scene import CUBE_START, Cube


def test_a_cube_out_of_reach_does_not_touch_the_hand():
    with_cube, alone = CubePlant(), BuiltHandPlant()
    for plant in (with_cube, alone):
        plant.advance_to(0.5)
    np.testing.assert_allclose(with_cube.joint_angles(), alone.joint_angles(), atol=1e-6)


def test_a_placed_cube_lies_where_it_was_put_and_then_falls():
    plant = CubePlant()
    plant.advance_to(0.1)
    plant.place_cube((0.11, 0.0, 0.5))
    np.testing.assert_array_equal(plant.cube_position(), [0.11, 0.0, 0.5])
    plant.advance_to(0.2)
    np.testing.assert_allclose(plant.cube_position(), [0.11, 0.0, 0.5 - 0.5 * 9.81 * 0.1**2], atol=2e-3)
    assert plant.cube_rotation == pytest.approx(0.0, abs=1e-9)


def test_a_cube_falls_in_a_hand_without_weight():
    plant = CubePlant(load_unit("ideal").hand)
    plant.place_cube((0.11, 0.0, 0.5))
    plant.advance_to(0.1)
    np.testing.assert_allclose(plant.cube_position(), [0.11, 0.0, 0.5 - 0.5 * 9.81 * 0.1**2], atol=2e-3)


def test_a_cube_is_touched_in_the_hand_and_not_in_the_air():
    plant = CubePlant()
    plant.place_cube((0.11, 0.0, 0.5))
    plant.advance_to(0.05)
    assert not plant.cube_touched()
    plant.place_cube(CUBE_START)
    touched = []
    for k in range(1, 31):
        plant.advance_to(0.05 + 0.01 * k)
        touched.append(plant.cube_touched())
    assert not touched[0]
    assert any(touched)


def test_rotation_is_counted_over_whole_turns_about_the_vertical_whatever_the_orientation():
    plant = CubePlant()
    for orientation in ((1.0, 0, 0, 0), (np.sqrt(0.5), np.sqrt(0.5), 0, 0), (0.5, 0.5, 0.5, 0.5)):
        plant.place_cube((1.0, 0, 0), orientation)
        start, rotation = plant.time, np.empty(9)
        mujoco.mju_quat2Mat(rotation, np.array(orientation, float))
        dof = plant._cube_dof
        plant._data.qvel[dof + 3 : dof + 6] = rotation.reshape(3, 3).T @ [0, 0, 8.0]
        for k in range(1, 101):
            plant.advance_to(start + 0.01 * k)
        assert plant.cube_rotation == pytest.approx(8.0, rel=1e-3)


HELD_UP_S = 0.1


def spin_when_held_up(cube):
    """Return the cube's angular velocity, (3,) rad/s, after its weight was borne at its middle for `HELD_UP_S`."""
    plant = CubePlant(cube=cube)
    plant.place_cube((1.0, 0.0, 0.0))
    body = plant._model.body("cube").id
    mujoco.mj_forward(plant._model, plant._data)
    start = plant.time
    for k in range(1, 51):
        middle, weight = np.array(plant.cube_position()), cube.mass_kg * 9.81
        arm = middle - plant._data.xipos[body]
        plant._data.xfrc_applied[body] = [0, 0, weight, *np.cross(arm, [0, 0, weight])]
        plant.advance_to(start + HELD_UP_S * k / 50)
    return plant._data.cvel[body, :3]


def test_a_centre_of_mass_beside_the_middle_tips_a_cube_that_is_held_at_its_middle():
    still = spin_when_held_up(Cube())
    np.testing.assert_allclose(still, 0.0, atol=1e-6)
    tipped = spin_when_held_up(Cube(centre_of_mass_m=(0.003, 0.0, 0.0)))
    # Weight at 3 mm, inertia of a cube: alpha = m g d / (m a² / 6).
    expected = 9.81 * 0.003 * 6 / 0.050**2 * HELD_UP_S
    np.testing.assert_allclose(tipped, [0.0, expected, 0.0], rtol=0.05, atol=0.05)


@pytest.mark.parametrize("cube", [Cube(side_m=0.045), Cube(side_m=0.055), Cube(mass_kg=0.14), Cube(friction=1.0)])
def test_a_cube_has_its_size_mass_and_friction(cube):
    model = CubePlant(cube=cube)._model
    geom = model.geom("cube")
    np.testing.assert_allclose(geom.size, cube.side_m / 2)
    assert model.body("cube").mass[0] == pytest.approx(cube.mass_kg)
    assert geom.friction[0] == cube.friction


def test_a_cube_is_clear_of_the_hand_only_where_nothing_is_near():
    plant = CubePlant(load_unit("reference").hand)
    plant.place_cube((0.08, 0.0, 0.05))
    plant.advance_to(0.002)
    assert plant.cube_clear(GAP_M)
    assert not plant.cube_clear(1.0)
    plant.advance_to(0.15)
    assert plant.cube_touched()  # it has dropped onto the open hand
    assert not plant.cube_clear(GAP_M)
