import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from hil.lab.policies.transmission_gap import channel_gaps

T = np.arange(200) * 0.05
GAIT = 0.05 * np.sin(2 * np.pi * 2.0 * T)[:, None] * np.ones(7)


def causes(simulated, replayed, closed_loop):
    return [gap.cause for gap in channel_gaps(simulated, replayed, closed_loop)]


@given(st.floats(-0.01, 0.01))
def test_a_constant_offset_is_no_gap_but_is_reported(offset):
    gaps = channel_gaps(GAIT, GAIT + offset, GAIT)
    assert [gap.cause for gap in gaps] == ["none"] * 7
    np.testing.assert_allclose([gap.offset for gap in gaps], offset, atol=1e-12)


@given(st.sampled_from(Channel), st.floats(0.0, 0.4))
def test_a_channel_that_does_not_follow_open_loop_is_the_transmissions(channel, followed):
    replayed = GAIT.copy()
    replayed[:, channel] *= followed
    expected = ["none"] * 7
    expected[channel] = "transmission"
    assert causes(GAIT, replayed, GAIT) == expected


@given(st.sampled_from(Channel), st.floats(0.0, 0.4) | st.floats(1.6, 3.0))
def test_a_gait_that_changes_only_in_closed_loop_is_the_feedbacks(channel, scale):
    closed = GAIT.copy()
    closed[:, channel] *= scale
    expected = ["none"] * 7
    expected[channel] = "feedback"
    assert causes(GAIT, GAIT, closed) == expected


def test_traces_of_different_length_are_refused():
    with pytest.raises(ValueError, match="one length"):
        channel_gaps(GAIT, GAIT[1:], GAIT)


def test_a_hand_that_hardly_moves_has_no_gap():
    noise = 1e-4 * np.random.default_rng(0).normal(size=GAIT.shape)
    assert causes(0.0 * GAIT, noise, noise) == ["none"] * 7
