from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from policies import network, policy
from policy_strategies import seeds

from aero.policy.file import load, save
from aero.policy.interface import PolicyFileError
from aero.policy.task import ShownAction


@given(seeds)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_policy_comes_back_as_it_went(tmp_path, seed):
    original = policy(seed, ShownAction.BEFORE_LAST)
    save(original, tmp_path / "a.npz")
    again = load(tmp_path / "a.npz")
    observation = network(seed).mean + 0.1
    np.testing.assert_array_equal(again.network.act(observation), original.network.act(observation))
    assert replace(again, network=original.network) == original


def test_the_same_policy_gives_the_same_bytes(tmp_path):
    for name in "ab":
        save(policy(), tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04 cut short", b"\x80\x04."])
def test_other_files_are_refused_with_the_remedy(tmp_path, content):
    path = tmp_path / "policy.npz"
    path.write_bytes(content)
    with pytest.raises(PolicyFileError, match="convert-policy"):
        load(path)


def test_a_missing_file_is_reported_as_missing(tmp_path):
    with pytest.raises(FileNotFoundError):
        load(tmp_path / "none.npz")
