"""Spring, friction and slack are told apart in a recording that has known ones."""

import numpy as np
import pytest
from synthetic import RANGES, replaced, staircase

from aero.channels import CABLES, Channel
from hil.experiments.staircase.cable_loads import loads


def test_springs_without_friction_come_out_as_they_are():
    recording = staircase(levels=10)
    found = loads(recording)
    assert set(found) == set(CABLES)
    for load in found.values():
        np.testing.assert_allclose(load.spring_a, 0.7 * np.arange(1, 10) / 10, atol=1e-9)
        np.testing.assert_allclose(load.friction_a, 0.0, atol=1e-9)
        assert load.take_up_mm == pytest.approx(load.travel_mm[0], abs=1e-9)


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


def test_a_cable_that_never_pulls_is_slack_all_the_way():
    recording = staircase(levels=10)
    currents = recording["currents"].values.copy()
    currents[:, Channel.INDEX] = 0.0
    load = loads(replaced(recording, "currents", currents))[Channel.INDEX]
    assert load.take_up_mm == pytest.approx(0.9 * 1e3 * RANGES[Channel.INDEX], rel=0.01)
    assert load.spring == 0.0


def test_one_level_has_no_load():
    with pytest.raises(ValueError, match="at least two levels"):
        loads(staircase(levels=1))
