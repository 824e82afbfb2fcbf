"""Policies that people bring, and what they declare."""

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from own_policies import write_factory, write_onnx
from policies import actions_on, policy

from aero.actuation import ActuationMap
from aero.channels import Channel
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
    """A folder that is the present one; what is imported of it is forgotten."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        if getattr(sys.modules[name], "__file__", None) and str(tmp_path) in str(sys.modules[name].__file__):
            del sys.modules[name]


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
        np.testing.assert_allclose(actions_on(brought, rows), actions_on(ours, rows), atol=1e-6)


WRONG = {
    'field = "last_action"': ('field = "speed"', "no field 'speed'"),
    '["index", "middle", "ring", "pinky", "thumb_cmc': ('["index", "index", "ring", "pinky", "thumb_cmc', "once each"),
    '"thumb_flexor", "thumb_abduction"]': ('"thumb_flexor"]', "failed on an observation of 13"),
    "torque_limit = 0.5": ("torque = 0.5", "knows no torque"),
    "scale = [0.02, 0.02,": ("scale = [0.02,", "scale needs one number or 7"),
    "nominal = [0.09,": ("nominal = [nan,", "nominal must be finite"),
}
"""A line of the interface file, what stands there instead, and what is said."""


@pytest.mark.parametrize("line", WRONG)
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
    "raise RuntimeError('no GPU')": "cannot be imported",
    "make = lambda: 5": "a callable",
    "make = lambda: lambda observation: observation[:6]": "returns 6 numbers; its interface names 7",
    "make = lambda: lambda observation: [float('nan')] * 7": "finite",
    "def make(): raise OSError('no weights')": "no weights",
}


@pytest.mark.parametrize("source", FACTORIES)
def test_a_factory_that_does_not_fit_is_one_line(here, source):
    name = write_factory(here, f"policy_{sorted(FACTORIES).index(source)}")
    (here / f"{name.partition(':')[0]}.py").write_text(source)
    with pytest.raises(PolicyFileError, match=FACTORIES[source]) as caught:
        find_policy(name)
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
