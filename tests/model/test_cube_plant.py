import mujoco
import numpy as np
import pytest

from model.cube_plant import CubePlant
from model.plant import BuiltHandPlant


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
