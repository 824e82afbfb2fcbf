"""Policies that people bring, and what they declare."""

import re
import sys

import numpy as np
import pytest
from drawn import drawn
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from onnx import TensorProto, helper
from own_policies import write_factory, write_interface, write_model, write_onnx
from policies import actions_on, policy

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.policy import own
from aero.policy.interface import Action, Field, History, Interface, Observed, PolicyFileError, cube_interface
from aero.policy.loop import interface_of
from aero.policy.running import RunSettings
from aero.policy.settings import PAPER_DEPLOYMENT
from aero.policy.shipped import find_policy
from aero.policy.task import ActionMemory, ShownAction, observe, targets

ROWS = arrays(np.float64, (5, 7), elements=st.floats(-0.1, 0.1))
MAP = ActuationMap()


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder that is the present one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@given(ROWS, ROWS, st.sampled_from(ShownAction))
def test_the_cube_tasks_interface_is_what_training_observes_and_means(lengths, acted, shown):
    settings = PAPER_DEPLOYMENT
    interface = cube_interface(settings, shown)
    history, memory = History(interface, MAP), ActionMemory.empty(np.zeros(7))
    for row, action in zip(lengths, acted, strict=True):
        np.testing.assert_array_equal(history.observe(row), observe(row, memory.shown(shown)))
        history.acted(action)
        memory = memory.after(action)
        wanted = targets(action, np.array(settings.nominal), np.array(settings.scale))
        np.testing.assert_array_equal(interface.action.target(action, MAP), wanted)


@given(ROWS, st.integers(1, 4), st.floats(-5, 5), st.floats(-1, 1), st.permutations(list(Channel)))
def test_order_scale_and_history_are_as_declared(lengths, depth, scale, offset, order):
    part = Observed(Field.LENGTHS, tuple(order[:3]), (scale,), (offset,), depth)
    history = History(Interface((part,), Action((0.0,) * 7, (1.0,))), MAP)
    for k, row in enumerate(lengths):
        seen = history.observe(row).reshape(depth, 3)
        expected = [lengths[max(0, k - back)] for back in range(depth - 1, -1, -1)]
        np.testing.assert_allclose(seen, (np.array(expected)[:, order[:3]] - offset) * scale)


@given(arrays(np.float64, 7, elements=st.floats(0.0, 0.3)), arrays(np.float64, 7, elements=st.floats(-1, 1)))
def test_angles_are_those_of_the_map_and_no_action_goes_beyond_the_reach(nominal, output):
    action = Action(tuple(nominal), (0.2,), Field.ANGLES)
    interface = Interface((Observed(Field.ANGLES),), action)
    target = action.target(action.bounded(output), MAP)
    off = np.abs(History(interface, MAP).observe(target) - (nominal + 0.2 * output))
    assert (off < [1e-9] * 5 + [0.007, 0.035]).all(), "the map fits the thumb's flexion"
    settings = interface.settings()
    assert (np.abs(target - settings.nominal) <= np.array(settings.scale) + 1e-12).all()


def test_a_channel_without_an_action_stays_and_an_action_is_cut_off():
    action = Action((0.1,) * 7, (0.01,), channels=(Channel.THUMB_FLEXOR, Channel.INDEX), clip=2.0)
    np.testing.assert_array_equal(action.bounded(np.array([9.0, -1.0])), [-1, 0, 0, 0, 0, 0, 2])
    np.testing.assert_allclose(action.target(action.bounded(np.array([9.0, -1.0])), MAP)[[0, 1, 6]], [0.09, 0.1, 0.12])


def test_currents_are_those_of_the_period_before_and_a_missing_reading_leaves_them():
    history = History(Interface((Observed(Field.CURRENTS),), Action((0.0,) * 7, (1.0,))), MAP)
    assert history.observe(np.zeros(7)).tolist() == [0.0] * 7
    history.drew(np.full(7, 0.5))
    assert history.observe(np.zeros(7)).tolist() == [0.5] * 7
    history.drew(np.full(7, np.nan))
    assert history.observe(np.zeros(7)).tolist() == [0.5] * 7


def test_the_shipped_policy_the_same_as_a_file_as_onnx_and_as_python(here):
    ours = find_policy("steady")
    rows = np.array(ours.settings.nominal) + np.random.default_rng(0).normal(0, 0.004, (200, 7))
    for name in (write_onnx(here), write_factory(here)):
        brought = find_policy(name)
        assert brought.interface == ours.interface
        np.testing.assert_allclose(actions_on(brought, rows), actions_on(ours, rows), atol=1e-5)


WRONG = {
    'field = "last_action"': ('field = "speed"', "unknown field 'speed'"),
    '["index", "middle", "ring", "pinky", "thumb_cmc': ('["index", "index", "ring", "pinky", "thumb_cmc', "once each"),
    '"thumb_flexor", "thumb_abduction"]': ('"thumb_flexor"]', "failed on an observation of 13"),
    "torque_limit = 0.5": ("torque = 0.5", "unknown 'torque'"),
    "scale = [0.02, 0.02,": ("scale = [0.02,", "scale needs one number or 7"),
    "nominal = [0.09,": ("nominal = [nan,", "nominal must be finite"),
}
"""A line of the interface file, what stands there instead, and what is said."""


@pytest.mark.parametrize("line", drawn(WRONG, 4))
def test_what_does_not_fit_is_one_line(here, line):
    name, (other, said) = write_onnx(here), WRONG[line]
    path = here / "mine.toml"
    text = path.read_text()
    assert line in text
    path.write_text(text.replace(line, other, 1))
    with pytest.raises(PolicyFileError, match=said) as caught:
        find_policy(name)
    assert "\n" not in str(caught.value)


FACTORIES = {
    "": "has no 'make'",
    "raise RuntimeError('no GPU')": "cannot be loaded",
    "make = lambda: 5": "a callable",
    "make = lambda: lambda observation: observation[:6]": "returns 6 numbers; its interface names 7",
    "make = lambda: lambda observation: [float('nan')] * 7": "finite",
    "def make(): raise OSError('no weights')": "no weights",
    "raise SystemExit(0)": r"SystemExit: 0, .*py:1",
    "def make(): raise SystemExit(0)": r"SystemExit: 0, .*py:1",
    "make = lambda: lambda observation: exit(0)": r"SystemExit: 0, .*py:1",
    "def make(): raise KeyboardInterrupt": r"KeyboardInterrupt, .*py:1",
    "import os\nmake = lambda: lambda observation: os._exit(0)": "its process has ended",
    "make = lambda: lambda observation: [float(input())] * 7": "EOFError",
    "def make():\n  import of_nobody": r"ModuleNotFoundError: No module named 'of_nobody', .*py:2",
    "def make(:": r"SyntaxError: .*py:1",
    "import numpy\nmake = lambda: lambda observation: numpy.zeros((100, 7))": r"700 numbers, an array \(100, 7\)",
    "make = lambda: lambda observation: [0.0] * 10**6": "returns 1000000 numbers",
}


@pytest.mark.parametrize("source", drawn(FACTORIES, 7))
def test_a_factory_that_does_not_fit_is_one_line(here, source):
    name = write_factory(here, f"policy_{sorted(FACTORIES).index(source)}")
    (here / f"{name.partition(':')[0]}.py").write_text(source)
    with pytest.raises(PolicyFileError, match=FACTORIES[source]) as caught:
        find_policy(name)
    assert "\n" not in str(caught.value)


def test_a_mistake_shows_the_frames_of_the_policy_alone(here):
    name = write_factory(here)
    source = (
        "import json\n\ndef read(text):\n    return json.loads(text)\n\nmake = lambda: lambda observation: read('{')\n"
    )
    (here / "my_policy.py").write_text(source)
    with pytest.raises(PolicyFileError, match=r"JSONDecodeError.*my_policy\.py:4\n") as caught:
        find_policy(name)
    (note,) = caught.value.__notes__
    assert [int(line) for line in re.findall(r'my_policy\.py", line (\d+)', note)] == [6, 4]
    assert "own_process" not in note


@pytest.mark.parametrize("name", drawn(["model", "train", "serial", "signal", "chunk", "hil"], 2))
def test_a_module_may_have_any_name_and_disturbs_nothing(here, monkeypatch, name):
    write_interface(here / f"{name}.toml")
    (here / f"{name}.py").write_text("OWN = 1\nmake = lambda: lambda observation: [0.0 * OWN] * 7")
    before = list(sys.path)
    assert find_policy(f"{name}:make").name == f"{name}:make"
    assert sys.path == before


def test_modules_in_the_folder_are_imported_first_and_those_of_python_are_not_replaced(here):
    name = write_factory(here)
    (here / "my_policy.py").write_text(
        "import signal, subprocess\nfrom model import OWN\n"
        "def make():\n  def act(observation):\n    from train import ALSO\n    return [0.0 * ALSO] * 7\n  return act\n"
    )
    (here / "model.py").write_text("OWN = 1")
    (here / "train.py").write_text("ALSO = 1")
    (here / "signal.py").write_text("raise RuntimeError('of the folder')")
    find_policy(name)


def test_what_a_policy_prints_is_shown_without_control_characters(here, capfd):
    name = write_factory(here)
    (here / "my_policy.py").write_text("print('\x1b[2Jred')\nmake = lambda: lambda observation: [0.0] * 7")
    network = find_policy(name).network
    network.end()
    assert capfd.readouterr().err == "\\x1b[2Jred\n"


def test_an_action_that_never_comes_ends_in_a_line_and_its_process(here, monkeypatch):
    name = write_factory(here)
    (here / "my_policy.py").write_text(
        "seen = []\ndef act(observation):\n  seen.append(1)\n  while len(seen) > 1: pass\n  return [0.0] * 7\n"
        "make = lambda: act"
    )
    monkeypatch.setattr(own, "STEP_S", 0.3)
    network = find_policy(name).network
    with pytest.raises(PolicyFileError, match=r"did not answer within 0\.3 s"):
        network.act(np.zeros(14))
    network.end()
    assert not network._process.running


def test_the_memory_of_an_onnx_file_is_bounded(here):
    ones = helper.make_tensor("value", TensorProto.FLOAT, [1], [1.0])
    nodes = [
        helper.make_node("ConstantOfShape", ["shape"], ["large"], value=ones),
        helper.make_node("ReduceSum", ["large"], ["sum"], keepdims=0),
        helper.make_node("Add", ["observation", "sum"], ["action"]),
    ]
    write_model(here / "mine.onnx", nodes, {"shape": np.array([340_000_000])})
    with pytest.raises(PolicyFileError, match="llocate"):
        find_policy("mine.onnx")


def test_names_in_an_onnx_file_reach_no_terminal(here, capfd):
    nodes = [helper.make_node("Reshape", ["observation", "shape"], ["action"], name="\x1b[2J")]
    write_model(here / "mine.onnx", nodes, {"shape": np.array([3, 5])})
    with pytest.raises(PolicyFileError):
        find_policy("mine.onnx")
    assert "\x1b" not in "".join(capfd.readouterr())


RANGES = {
    "nominal = [0.09,": "nominal = [1e308,",
    "scale = [0.02, 0.02,": "scale = [1e308, 0.02,",
    'field = "last_action"': 'field = "last_action"\nhistory = 1000000000',
    "rate_hz = 20.0": "rate_hz = 1e9",
    "torque_limit = 0.5": "torque_limit = 1e400",
    "[action]": "[action]\nclip = 1e308",
    "[[observation]]": "[[observation]]\nscale = 1e308",
}


@pytest.mark.parametrize("line", RANGES)
def test_a_number_beyond_every_hand_is_one_line(here, line):
    write_interface(here / "mine.toml")
    text = (here / "mine.toml").read_text()
    assert line in text
    (here / "mine.toml").write_text(text.replace(line, RANGES[line], 1))
    with pytest.raises(PolicyFileError) as caught:
        Interface.load(here / "mine.toml")
    assert "\n" not in str(caught.value)


def test_an_interface_that_is_missing_says_what_it_is_for(here):
    name = write_onnx(here)
    (here / "mine.toml").unlink()
    with pytest.raises(PolicyFileError, match=r"mine\.toml is missing.*steady\.toml"):
        find_policy(name)


def test_a_declared_policy_takes_no_settings_of_the_cube_task(here):
    brought = find_policy(write_factory(here))
    assert interface_of(brought, RunSettings()) == brought.interface
    with pytest.raises(ValueError, match="declares"):
        interface_of(brought, RunSettings(settings=PAPER_DEPLOYMENT))
    assert interface_of(policy(), RunSettings(settings=PAPER_DEPLOYMENT)).action.nominal == PAPER_DEPLOYMENT.nominal


def test_a_file_without_a_clip_bounds_actions_to_one():
    assert Action((0.1,) * 7, (0.01,)).bounded(np.full(7, 9.0)).tolist() == [1.0] * 7
    assert Action((0.1,) * 7, (0.01,)).bounded(np.full(7, -9.0)).tolist() == [-1.0] * 7


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[observation]\n"" = 1', "two brackets"),
        ('[[observation]]\n"" = 1', "unknown ''"),
        ("observation = [1]", "an observation is a table, got 1"),
        ('action = 3\n[[observation]]\nfield = "lengths"', "the action is a table, got 3"),
    ],
)
def test_a_table_of_another_kind_is_one_line(text, said, here):
    (here / "mine.toml").write_text(text)
    with pytest.raises(PolicyFileError) as caught:
        Interface.load(here / "mine.toml")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
