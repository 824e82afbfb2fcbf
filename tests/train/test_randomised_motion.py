"""Every row of every randomisation changes the motion, one row at a time, and alike on both backends."""

from dataclasses import replace
from itertools import product

import mujoco
import numpy as np
import pytest

from aero.channels import JOINT_BOX_RAD
from aero.policy.settings import PAPER_TRAINING
from simulator.scene import CUBE, OFF_CENTRE_M, RANGES, Cube
from train import randomise
from train.simulator import Simulator, build_scene, positions, tip_geoms, velocities
from train.task import NOMINAL_RESET, draw_starts

TORQUE_LIMIT = 0.5
PERIODS, STEPS = 10, 5
VISIBLE = 1e-6
"""A change of a joint (rad) or of the cube's position (m) that rounding in double precision does not make."""
SINGLE_PRECISION = 5e-5
"""Between velocities on both backends after one physics step, rad/s and m/s: a hundred roundings of 5 rad/s."""

MODEL = build_scene(TORQUE_LIMIT).compile()
ROWS = (*randomise.table(MODEL), *randomise.SERVO_ROWS)
START = draw_starts(np.random.default_rng(0), 1, NOMINAL_RESET)
ACTIONS = np.random.default_rng(1).uniform(-1, 1, (PERIODS, 1, 1, len(PAPER_TRAINING.scale)))
CONTROLS = np.array(PAPER_TRAINING.nominal) + np.array(PAPER_TRAINING.scale) * ACTIONS


def one_row_each(model, *more):
    """Return draws for one environment a row, in which nothing but that row is drawn, `more`, and one as compiled."""
    alone = [*(randomise.draw(model, np.random.default_rng(2), 1, (row,)) for row in ROWS), *more]
    names = sorted({name for draws in alone for name in draws})
    return {
        name: np.concatenate([draws.get(name, getattr(model, name)[None]) for draws in (*alone, {})]) for name in names
    }


def motion(batch, steps=STEPS, periods=PERIODS):
    """Return what every scene's joints and cube do, (periods, batch, 23)."""
    states = batch.at(np.repeat(START, len(batch), axis=0))
    went = []
    for control in CONTROLS[:periods]:
        states, _ = batch.advance(states, np.broadcast_to(control, (len(batch), steps, control.shape[-1])))
        went.append(positions(states))
    return np.array(went)


@pytest.fixture(scope="module")
def native_changes():
    with Simulator(randomise.models(MODEL, one_row_each(MODEL)), threads=1) as simulator:
        went = motion(simulator)
    return np.abs(went[:, :-1] - went[:, -1:]).max(axis=(0, 2))


@pytest.mark.parametrize("number", range(len(ROWS)), ids=[row.name for row in ROWS])
def test_each_row_alone_changes_the_motion(number, native_changes):
    assert native_changes[number] > VISIBLE


CHANGES = {**RANGES, "centre_of_mass_m": ((0.0, 0.0, 0.0), (OFF_CENTRE_M, 0.0, 0.0))}


def compiled(cube):
    return build_scene(TORQUE_LIMIT, cube).compile()


CORNERS = [
    Cube(side_m=side, mass_kg=mass, friction=friction, centre_of_mass_m=(0.0, 0.0, off))
    for side, mass, friction, off in product((0.045, 0.055), (0.040, 0.140), (0.3, 1.0), (-0.003, 0.003))
]


def test_a_drawn_cube_moves_as_a_compiled_one():
    scenes = [compiled(cube) for cube in CORNERS]
    drawn = randomise.models(MODEL, randomise.cube_draws(scenes))
    with Simulator(scenes, threads=1) as one, Simulator(drawn, threads=1) as other:
        np.testing.assert_allclose(motion(other), motion(one), atol=1e-9)


@pytest.mark.slow
def test_the_same_draw_moves_alike_on_both_backends():
    """One physics step with a ball for the cube: contacts of boxes differ by more between the backends.

    The ball spins and slides off the index fingertip; every joint moves, and nothing else touches anything. The
    solver converges here: cut off after the scene's 8 steps of line search, the backends part by 0.025 rad/s.
    """
    jax = pytest.importorskip("jax", reason="needs the extra `train`")
    from train.environment import over_mjx  # noqa: PLC0415 - only this test needs the extra

    model = _with_a_ball(CUBE)
    others = [_with_a_ball(replace(CUBE, **{name: ends[-1]})) for name, ends in CHANGES.items()]
    draws = one_row_each(model, *(randomise.cube_draws([other]) for other in others))
    state, control = _sliding(model)
    count = len(ROWS) + len(others) + 1
    controls = np.broadcast_to(control, (count, 1, len(control)))
    with Simulator(randomise.models(model, draws), threads=1) as simulator:
        states = np.repeat(np.float64(state[None]), count, axis=0)
        ends = [advance(states, controls)[0] for advance in (simulator.advance, jax.jit(over_mjx(model, draws)))]
    native, mjx = (velocities(np.asarray(end, np.float64)) for end in ends)
    assert (np.abs(native[:-1] - native[-1]).max(axis=1) > 50 * SINGLE_PRECISION).all()
    np.testing.assert_allclose(mjx, native, atol=SINGLE_PRECISION)


def _with_a_ball(cube):
    spec = build_scene(TORQUE_LIMIT, cube)
    spec.geom("cube").type = mujoco.mjtGeom.mjGEOM_SPHERE
    spec.option.iterations, spec.option.ls_iterations = 20, 50
    return spec.compile()


def _sliding(model):
    """Return a training state, single precision, of a ball that slides off the index fingertip, and a control."""
    data = mujoco.MjData(model)
    joints = JOINT_BOX_RAD @ (0.7, 0.3)
    data.qpos[: len(joints)] = joints
    mujoco.mj_forward(model, data)
    tip = tip_geoms(model)[0]
    along, _, across = data.geom_xmat[tip].reshape(3, 3).T
    reach = model.geom_size[tip, 0] + model.geom("cube").size[0] - 0.0002
    side = np.sign(along @ (data.geom_xpos[tip] - data.body("palm").xpos))
    data.qpos[len(joints) :] = (*(data.geom_xpos[tip] + side * reach * along), 1, 0, 0, 0)
    data.qvel[:] = (*np.linspace(-1, 1, len(joints)), *(0.3 * across), 3, -2, 5)
    return np.float32(np.concatenate([[0.0], data.qpos, data.qvel])), np.array(PAPER_TRAINING.nominal)
