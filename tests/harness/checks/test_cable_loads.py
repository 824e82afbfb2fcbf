"""Spring, friction and slack are told apart in a recording that has known ones."""

import numpy as np
import pytest
from synthetic import RANGES, replaced, staircase

from aero.channels import CABLES, Channel
from hil.checks.staircase.cable_loads import Load, loads


def test_springs_without_friction_come_out_as_they_are():
    recording = staircase(levels=10)
    found = loads(recording)
    assert set(found) == set(CABLES)
    for load in found.values():
        np.testing.assert_allclose(load.spring_a, 0.7 * np.arange(1, 10) / 10, atol=1e-9)
        np.testing.assert_allclose(load.friction_a, 0.0, atol=1e-9)
        assert load.take_up_mm == 0.0


@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_friction_is_half_the_gap_between_the_two_ways(friction):
    recording = staircase(levels=10)
    command = recording["command"].values
    ways = np.zeros_like(command)
    for row in range(1, len(ways)):
        changed = np.sign(command[row] - command[row - 1])
        ways[row] = np.where(changed != 0, changed, ways[row - 1])
    signs = np.array([1, 1, 1, 1, 1, 1, -1])
    pulled = replaced(recording, "currents", signs * (0.7 * command / RANGES + friction * ways))
    for load in loads(pulled).values():
        assert load.friction == pytest.approx(friction)


def test_slack_is_the_travel_before_the_load_begins():
    recording = staircase(levels=10)
    currents = recording["currents"].values.copy()
    part = recording["command"].values[:, Channel.RING] / RANGES[Channel.RING]
    currents[:, Channel.RING] = np.where(part > 0.45, 0.5, 0.0)
    load = loads(replaced(recording, "currents", currents))[Channel.RING]
    assert load.take_up_mm == pytest.approx(0.4 * 1e3 * RANGES[Channel.RING], rel=0.01)


def load(springs, frictions=None, travel=None):
    springs = np.array(springs, float)
    travel = np.arange(1.0, len(springs) + 1) if travel is None else travel
    return Load(np.array(travel), springs, springs * 0 if frictions is None else np.array(frictions, float))


def test_a_cable_is_taut_from_0_04_a_on():
    assert load([0.04, 0.5]).take_up_mm == 0.0
    assert load([0.039, 0.04]).take_up_mm == 1.0
    assert load([0.0, 0.03, 0.01, 0.5, 0.0]).take_up_mm == 3.0
    assert load([0.0, 0.0, 0.0]).take_up_mm == 3.0


def test_spring_and_friction_are_those_of_the_middle_of_the_sweep():
    """Of ten levels the fourth to the eighth: their median, and their upper quartile."""
    springs = [9, 9, 9, 0.1, 0.2, 0.3, 0.4, 0.5, 9, 9]
    assert load(springs).spring == pytest.approx(0.3)
    assert load(np.zeros(10), springs).friction == pytest.approx(0.4)
    assert load([0.7], [0.2]).spring == 0.7
    assert load([0.7, 9.0]).spring == 0.7
    assert load([0.7, 9.0], [0.2, 9.0]).friction == pytest.approx(0.2)


def test_a_load_that_grows_evenly_has_its_shape():
    """Of twenty levels the fourth to the ninth, and the twelfth to the seventeenth."""
    springs = np.arange(1, 21) / 20
    found = load(springs, 0.1 + 0.5 * springs)
    assert found.spring_shape == pytest.approx(14.5 / 6.5)
