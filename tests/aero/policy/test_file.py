import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from policies import network, policy, seeds

from aero.policy.file import load, save
from aero.policy.interface import PolicyFileError
from aero.policy.task import ShownAction


@given(seeds)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_policy_comes_back_as_it_went(tmp_path, seed):
    original = replace(policy(seed, ShownAction.BEFORE_LAST), trained_lag_s=(0.015, 0.04), trained_delay_s=(0.01, 0.03))
    save(original, tmp_path / "a.npz")
    again = load(tmp_path / "a.npz")
    observation = network(seed).mean + 0.1
    np.testing.assert_array_equal(again.network.act(observation), original.network.act(observation))
    assert replace(again, network=original.network) == original


def test_the_same_policy_gives_the_same_bytes(tmp_path):
    for name in "ab":
        save(policy(), tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def rewrite(path, change_header=lambda header: None, change_arrays=lambda arrays: None):
    with np.load(path) as archive:
        arrays = dict(archive)
    header = json.loads(str(arrays["header"]))
    change_header(header)
    arrays["header"] = np.array(json.dumps(header))
    change_arrays(arrays)
    np.savez(path, **arrays)


HEADER_CHANGES = {
    "version": lambda h: h.update(version=2),
    "observation": lambda h: h["observation"].reverse(),
    "action": lambda h: h["action"].reverse(),
    "activation": lambda h: h.update(activation="relu"),
    "missing": lambda h: h.pop("shown_action"),
    "unknown": lambda h: h.update(extra=1),
    "ShownAction": lambda h: h.update(shown_action="first"),
    "nominal": lambda h: h["settings"].update(nominal=[0.0]),
    "unexpected keyword": lambda h: h["settings"].update(gain=1),
    "range of times": lambda h: h.update(trained_lag_s=[0.2, 0.1]),
}


@pytest.mark.parametrize("message", HEADER_CHANGES)
def test_a_header_that_means_something_else_is_refused(tmp_path, message):
    path = tmp_path / "policy.npz"
    save(policy(), path)
    rewrite(path, change_header=HEADER_CHANGES[message])
    with pytest.raises(PolicyFileError, match=message):
        load(path)


ARRAY_CHANGES = {
    "unknown arrays": lambda a: a.update(value_0=np.zeros(3)),
    "kernel_1": lambda a: a.pop("kernel_1"),
    "not finite": lambda a: a["bias_0"].fill(np.nan),
}


@pytest.mark.parametrize("message", ARRAY_CHANGES)
def test_weights_that_do_not_fit_are_refused(tmp_path, message):
    path = tmp_path / "policy.npz"
    save(policy(), path)
    rewrite(path, change_arrays=ARRAY_CHANGES[message])
    with pytest.raises(PolicyFileError, match=message):
        load(path)


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04 cut short", b"\x80\x04."])
def test_other_files_are_refused_with_the_remedy(tmp_path, content):
    path = tmp_path / "policy.npz"
    path.write_bytes(content)
    with pytest.raises(PolicyFileError, match="convert-policy"):
        load(path)


def test_a_missing_file_is_reported_as_missing(tmp_path):
    with pytest.raises(FileNotFoundError):
        load(tmp_path / "none.npz")
