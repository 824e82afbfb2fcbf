"""The plant as an interface: time, drives, efforts, motors. What hangs on the shafts is in `test_built_hand`."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from measured_hand import step_rise
from servo_law import STALL, push, settle, towards

from aero.channels import Channel
from firmware_emulator.plant import Drive
from model import BuiltHandParameters, BuiltHandPlant

LOOSE = BuiltHandParameters(cable_take_up=(0.5,) * 7)
"""So much cable that the spools turn without moving anything."""


@pytest.fixture
def plant() -> BuiltHandPlant:
    return BuiltHandPlant()


def test_starts_at_rest_in_the_extended_pose(plant):
    settle(plant, 0.5)
    assert np.abs(plant.angles()).max() < 2e-3
    assert np.abs(plant.speeds()).max() < 1e-3
    assert np.abs(plant.joint_angles()).max() < 2e-3


def test_time_never_goes_backwards(plant):
    plant.drive(0, towards(2.0))
    plant.advance_to(0.1)
    before = plant.angles()
    plant.advance_to(0.05)
    plant.advance_to(0.1)
    assert plant.time == 0.1
    assert np.array_equal(plant.angles(), before)


@settings(max_examples=10, deadline=None)
@given(st.lists(st.floats(1e-5, 4e-3), min_size=50, max_size=100), st.floats(0.3, 5.0))
def test_cutting_time_differently_hardly_changes_the_motion(spans, goal):
    """Shortened steps are stable and consistent: within 1 % of the travel of uncut time."""
    cut, whole = BuiltHandPlant(), BuiltHandPlant()
    for plant in (cut, whole):
        plant.drive(Channel.INDEX, towards(goal))
    for span in spans:
        cut.advance_to(cut.time + span)
    whole.advance_to(cut.time)
    assert cut.angles()[0] == pytest.approx(whole.angles()[0], abs=0.01 * goal + 2e-3)


def test_the_same_calls_give_the_same_state_to_the_bit():
    states = []
    for _ in range(2):
        plant = BuiltHandPlant()
        for step in range(60):
            plant.drive(step % 7, towards(0.3 * (step % 5)))
            plant.advance_to(plant.time + 0.0071)
        states.append((plant.angles(), plant.speeds(), plant.joint_angles()))
    for first, second in zip(*states, strict=True):
        assert np.array_equal(first, second)


def test_looking_changes_nothing():
    watched, alone = BuiltHandPlant(), BuiltHandPlant()
    for plant in (watched, alone):
        for shaft in range(7):
            plant.drive(shaft, towards(1.2))
    for step in range(1, 100):
        watched.advance_to(step * 0.0033)
        watched.cable_tensions()
        watched.slack()
        watched.efforts()
        watched.joint_angles()
        alone.advance_to(step * 0.0033)
    assert np.array_equal(watched.angles(), alone.angles())


def test_effort_is_the_clipped_law(plant):
    plant.drive(1, Drive(setpoint=0.5, stiffness=2.0, damping=0.1, torque=0.05, limit=0.3))
    plant.drive(2, Drive(setpoint=0.1, stiffness=2.0, damping=0.1, torque=0.05, limit=0.3))
    assert plant.efforts() == pytest.approx([0, 0.3, 0.25, 0, 0, 0, 0])
    plant.advance_to(0.01)
    law = 0.05 + 2.0 * (0.1 - plant.angles()[2]) - 0.1 * plant.speeds()[2]
    assert plant.efforts()[2] == pytest.approx(law)
    assert plant.speeds()[2] > 0


CHANGES = st.one_of(
    st.tuples(st.just("drive"), st.integers(0, 6), st.floats(-1.0, 1.0)),
    st.tuples(st.just("goal"), st.integers(0, 6), st.floats(-1.0, 1.0)),
    st.tuples(st.just("advance"), st.just(0), st.floats(0.0, 0.02)),
)


@settings(max_examples=20, deadline=None)
@given(st.lists(CHANGES, max_size=12))
def test_the_state_is_the_present_one_whatever_was_asked_before(changes):
    asked, alone = BuiltHandPlant(), BuiltHandPlant()
    for plant in (asked, alone):
        for shaft in range(7):
            plant.drive(shaft, towards(0.5))
    asked.state()
    for what, shaft, value in changes:
        for plant in (asked, alone):
            if what == "drive":
                plant.drive(shaft, towards(value))
            elif what == "goal":
                plant.set_setpoint(shaft, value)
            else:
                plant.advance_to(plant.time + value)
        asked.state()
    assert asked.state() == alone.state()
    assert asked.state().angles == alone.angles().tolist()


def test_setting_only_the_goal_is_the_same_as_driving_anew():
    one, other = BuiltHandPlant(), BuiltHandPlant()
    one.drive(4, towards(0.0))
    one.set_setpoint(4, 1.0)
    other.drive(4, towards(1.0))
    for plant in (one, other):
        settle(plant, 0.1)
    assert np.array_equal(one.angles(), other.angles())
    assert np.array_equal(one.efforts(), other.efforts())


def test_a_sagging_supply_weakens_the_motor_not_the_reported_effort():
    full, sagging = (
        BuiltHandPlant(replace(LOOSE, supply_ratio=ratio, spool_friction=(0.0,) * 7)) for ratio in (1.0, 0.5)
    )
    for plant in (full, sagging):
        plant.drive(0, push(0.4))
        settle(plant, 0.3)
        assert plant.efforts()[0] == 0.4
    assert sagging.speeds()[0] == pytest.approx(0.5 * full.speeds()[0], rel=1e-3)


def test_an_unpowered_shaft_coasts_and_a_powered_one_brakes():
    coasting, braking = (BuiltHandPlant(replace(LOOSE, spool_friction=(0.0,) * 7)) for _ in range(2))
    for plant in (coasting, braking):
        plant.drive(0, push(0.3))
        settle(plant, 0.2)
    coasting.drive(0, Drive(powered=False))
    braking.drive(0, Drive(powered=True))
    before = coasting.speeds()[0]
    for plant in (coasting, braking):
        settle(plant, 0.1)
    assert coasting.speeds()[0] == pytest.approx(before, rel=1e-3)
    assert braking.speeds()[0] < 0.01 * before


def test_a_step_ends_without_overshoot_as_recorded():
    """164 counts: rises in about 50 ms and does not overshoot (public logs, 600-count and smaller steps)."""
    rise, overshoot = step_rise()
    assert overshoot <= 0.005
    assert 0.03 <= rise <= 0.07


def test_divergence_is_reported(plant, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves a log where it runs
    plant.drive(0, Drive(setpoint=1.0, stiffness=1e12, limit=1e12))
    with pytest.raises(ArithmeticError, match="physics failed"):
        settle(plant, 5.0)


def test_a_current_limit_holds_a_blocked_shaft_back_and_not_a_free_one():
    angles, tops = {}, {}
    for limit in (0.2, STALL):
        blocked, loose = BuiltHandPlant(), BuiltHandPlant(LOOSE)
        for plant in (blocked, loose):
            plant.drive(Channel.INDEX, replace(towards(20.0), current_limit=limit))
            plant.advance_to(0.5)
        angles[limit], tops[limit] = blocked.angles()[Channel.INDEX], loose.speeds()[Channel.INDEX]
    assert angles[0.2] < angles[STALL] - 0.05
    assert tops[0.2] == pytest.approx(tops[STALL], rel=0.01)
