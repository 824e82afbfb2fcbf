import pickle
import subprocess
import sys
import types

import numpy as np
import pytest
from click.testing import CliRunner
from policies import network

from aero.policy.file import load, save
from aero.policy.settings import PAPER_DEPLOYMENT, PAPER_TRAINING
from aero.policy.task import ShownAction
from hil.cli import main
from train.convert import CheckpointError, convert


def layers(net):
    return {f"hidden_{i}": {"kernel": layer.kernel, "bias": layer.bias} for i, layer in enumerate(net.layers)}


class Statistics:
    """Pickles under Brax's name, as a dataclass does."""

    def __init__(self, net):
        self.mean = {"state": net.mean, "privileged_state": np.zeros(81, np.float32)}
        self.std = {"state": net.std, "privileged_state": np.ones(81, np.float32)}
        self.count = np.array(3e8, np.float32)


@pytest.fixture
def checkpoint(tmp_path, monkeypatch):
    module = types.ModuleType("brax.training.acme.running_statistics")
    named = type("RunningStatisticsState", (Statistics,), {"__module__": module.__name__})
    module.RunningStatisticsState = named
    for name in ("brax", "brax.training", "brax.training.acme"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    net = network(5, (14, 32, 16, 14))
    path = tmp_path / "ppo_checkpoint"
    path.write_bytes(pickle.dumps((named(net), {"params": layers(net)}, {"params": {}})))
    return path, net


def test_a_checkpoint_becomes_a_policy_file_that_acts_the_same(checkpoint, tmp_path):
    path, net = checkpoint
    policy = convert(path, PAPER_TRAINING)
    save(policy, tmp_path / "mine.npz")
    observations = np.random.default_rng(0).normal(size=(100, 14)) * net.std + net.mean
    np.testing.assert_array_equal(load(tmp_path / "mine.npz").network.act(observations), net.act(observations))
    assert policy.name == "ppo_checkpoint"
    assert policy.shown_action is ShownAction.BEFORE_LAST
    assert policy.provenance["source"] == "ppo_checkpoint"
    assert len(policy.provenance["sha256"]) == 64


class Call:
    def __init__(self, function, *arguments):
        self.reduced = (function, arguments)

    def __reduce__(self):
        return self.reduced


MALICIOUS = {
    "subprocess.run": lambda: Call(subprocess.run, ["touch", "/tmp/pwned"]),
    "builtins.eval": lambda: Call(eval, "1"),
    "builtins.getattr": lambda: Call(getattr, "a", "upper"),
    "numpy.load": lambda: Call(np.load, "x"),
}


@pytest.mark.parametrize("name", MALICIOUS)
def test_a_pickle_that_asks_for_anything_else_is_refused_before_it_is_called(tmp_path, name):
    path = tmp_path / "evil"
    path.write_bytes(pickle.dumps((MALICIOUS[name](), {}, {})))
    with pytest.raises(CheckpointError, match=f"asks for {name.split('.')[0]}.*do not trust"):
        convert(path, PAPER_TRAINING)


def test_a_jax_array_may_not_smuggle_another_function(tmp_path):
    path = tmp_path / "evil"
    payload = b"cjax._src.array\n_reconstruct_array\n(cnumpy\ndtype\n(S'f4'\nt(tNtR."
    path.write_bytes(payload)
    with pytest.raises(CheckpointError, match="only NumPy's rebuilding"):
        convert(path, PAPER_TRAINING)


@pytest.mark.parametrize(
    "content",
    [b"", b"hello", pickle.dumps(3), pickle.dumps((1, 2, 3)), pickle.dumps({"a": 1}), pickle.dumps(([], {}, {}))[:-3]],
)
def test_other_files_are_refused(tmp_path, content):
    path = tmp_path / "file"
    path.write_bytes(content)
    with pytest.raises(CheckpointError, match="not a Brax PPO checkpoint"):
        convert(path, PAPER_TRAINING)


def test_a_folder_asks_for_the_extra_where_it_is_missing(tmp_path, monkeypatch):
    (tmp_path / "_METADATA").write_text("{}")
    monkeypatch.setitem(sys.modules, "brax.training.agents.ppo", None)
    with pytest.raises(CheckpointError, match=r"pip install -e '\.\[train\]'"):
        convert(tmp_path, PAPER_TRAINING)


def test_the_command_writes_a_policy_with_what_it_was_told(checkpoint, tmp_path):
    path, _ = checkpoint
    arguments = ["convert-policy", str(path), str(tmp_path / "mine.npz"), "--shown-action", "last"]
    result = CliRunner().invoke(main, [*arguments, "--settings", "deployment"], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    policy = load(tmp_path / "mine.npz")
    assert policy.shown_action is ShownAction.LAST
    assert policy.settings == PAPER_DEPLOYMENT
