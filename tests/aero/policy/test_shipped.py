"""The policies that ship: what must hold of each, whatever it was trained to do."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from policy_strategies import finite_observations

from aero.policy.file import load
from aero.policy.interface import PolicyFileError
from aero.policy.settings import PAPER_TRAINING
from aero.policy.shipped import DEFAULT, find_policy, shipped_policies
from aero.policy.task import targets
from simulator.routed import COMMAND_RANGE

shipped = cache(find_policy)


def test_one_policy_ships_under_the_name_of_the_recipe_that_made_it():
    assert shipped_policies() == (DEFAULT,) == ("steady",)
    policy = find_policy(DEFAULT)
    assert policy.name == policy.provenance["recipe"] == DEFAULT
    assert {"recipe", "backend", "seed", "attempt", "steps", "versions"} <= set(policy.provenance)
    assert policy.settings.torque_limit == 0.5
    assert policy.settings.control_rate_hz == PAPER_TRAINING.control_rate_hz


@given(observation=finite_observations)
def test_actions_and_targets_are_in_range_for_any_finite_observation(observation):
    policy = shipped(DEFAULT)
    action = policy.network.act(observation)
    assert np.isfinite(action).all()
    assert (np.abs(action) < 1).all()
    target = targets(action, np.array(policy.settings.nominal), np.array(policy.settings.scale))
    low, high = np.array([COMMAND_RANGE[channel] for channel in sorted(COMMAND_RANGE)]).T
    assert (low <= target).all()
    assert (target <= high).all()


def test_a_path_is_taken_where_the_name_is_no_shipped_one(tmp_path):
    source = Path(find_policy.__code__.co_filename).parent / "steady.npz"
    copy = tmp_path / "mine.npz"
    copy.write_bytes(source.read_bytes())
    assert find_policy(str(copy)).provenance == load(source).provenance


def test_an_unknown_name_is_refused_with_the_names_there_are():
    with pytest.raises(PolicyFileError, match="choose from steady"):
        find_policy("slow")
