"""Open-loop replay, on a recording made by hand."""

import math

import numpy as np
import pytest

from hil.checks.replay import check as open_loop_replay
from hil.recordings.recording import Recording, Series
from tests.support.synthetic import HEADER, LABELS, UNITS


@pytest.mark.parametrize("delay", [0.04, -0.1, 0.195])
def test_delay_offset_and_shape_of_a_replay_are_told_apart(delay):
    """The hand is the simulator some ms later and 2 mm (mrad) further; until 1.2 s it is anywhere."""
    t = 0.005 * np.arange(1801)
    wave = 0.01 * np.sin(2 * np.pi * 0.5 * t)[:, None] * np.ones(7)
    late = 0.01 * np.sin(2 * np.pi * 0.5 * (t - delay))[:, None] * np.ones(7) + 0.002
    late[t < 1.2 + 1e-6] = 5.0
    # The simulator's trace goes on for long enough to be shifted.
    series = {"model": Series.of(LABELS, UNITS, t, wave), "hand": Series.of(LABELS, UNITS, t[:-40], late[:-40])}
    found = open_loop_replay.measure(Recording(HEADER, series))
    for label in LABELS:
        assert found[label]["replay_delay"] == pytest.approx(1e3 * delay)
        assert found[label]["replay_shape"] == pytest.approx(0.0, abs=1e-3)


def test_what_is_left_after_the_delay_is_the_shape():
    """A hand that overdoes a wave of 10 mm by a tenth is off by 1 mm, 0.707 of it as root mean square."""
    t = 0.005 * np.arange(1801)
    wave = 0.01 * np.sin(2 * np.pi * 0.5 * t)[:, None] * np.ones(7)
    series = {"model": Series.of(LABELS, UNITS, t, wave), "hand": Series.of(LABELS, UNITS, t, 1.1 * wave)}
    found = open_loop_replay.measure(Recording(HEADER, series))
    for label in LABELS:
        assert found[label]["replay_delay"] == pytest.approx(0.0, abs=1e-9)
        assert found[label]["replay_shape"] == pytest.approx(math.sqrt(0.5), rel=0.01)


def test_the_actions_begin_after_a_second_at_rest_and_oscillate_each_at_its_own_rate():
    """Sines of 0.4 with 0.5 to 0.8 Hz for 8 s."""
    actions = open_loop_replay._actions()
    period = 9.0 / len(actions)
    t = period * np.arange(len(actions))
    assert not actions[t < 1.0].any()
    for channel, rate in enumerate((0.6, 0.7, 0.5, 0.8, 0.5, 0.65, 0.55)):
        expected = 0.4 * np.sin(2 * np.pi * rate * (t - 1.0)) * (t > 1.0)
        np.testing.assert_allclose(actions[:, channel], expected, atol=1e-9)
