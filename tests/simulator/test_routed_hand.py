"""What the routed geometry gives: sweeps, extremes and the mirrored hand, against the released model's figures."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from aero.channels import FINGERS, Channel, Joint
from simulator import RoutedHand, build_routed
from simulator.geometry.winding import WINDING

RELEASED_EXTREMES = {
    Channel.INDEX: (0.061587, 0.107522),
    Channel.MIDDLE: (0.062140, 0.108205),
    Channel.RING: (0.061583, 0.107518),
    Channel.PINKY: (0.063683, 0.109323),
    Channel.THUMB_CMC_FLEXION: (0.026914, 0.037898),
    Channel.THUMB_FLEXOR: (0.083380, 0.110037),
}
"""Sensor extremes of one actuator swept over its range, measured on the released model with MuJoCo 4.0, m."""


def extended_command(hand: RoutedHand) -> np.ndarray:
    command = hand.command_range[:, 1].copy()
    command[Channel.THUMB_ABDUCTION] = hand.command_range[Channel.THUMB_ABDUCTION, 0]
    return command


def sweep(hand: RoutedHand, channel: Channel) -> np.ndarray:
    """Move one actuator over its range and back; return the joint angles at the closed end and the readings."""
    hand.reset()
    command = extended_command(hand)
    low, high = hand.command_range[channel]
    closing = np.linspace(low, high, 11) if channel is Channel.THUMB_ABDUCTION else np.linspace(high, low, 11)
    readings = []
    for goal in (*closing, closing[-1], closing[-1]):
        command[channel] = goal
        hand.command(command)
        hand.advance(1.0)
        readings.append(hand.lengths()[channel])
    return np.array(readings)


@pytest.fixture(scope="module")
def hand() -> RoutedHand:
    return RoutedHand()


@pytest.mark.parametrize("channel", RELEASED_EXTREMES)
def test_cable_sweep(hand, channel):
    readings = sweep(hand, channel)
    low, high = RELEASED_EXTREMES[channel]
    # Where dry friction leaves the CMC joint depends on the sweep; the others end at their stops.
    tolerance = 1e-4 if channel is Channel.THUMB_CMC_FLEXION else 2e-6
    assert readings.min() == pytest.approx(low, abs=tolerance)
    assert readings.max() == pytest.approx(high, abs=tolerance)


def test_abduction_reach(hand):
    readings = sweep(hand, Channel.THUMB_ABDUCTION)
    assert np.ptp(readings) == pytest.approx(1.746, abs=5e-3)


@pytest.mark.parametrize("finger", FINGERS)
def test_a_finger_closes_completely(hand, finger):
    sweep(hand, finger)
    assert hand.joint_angles()[3 * finger : 3 * finger + 3] == pytest.approx(np.full(3, np.pi / 2), abs=0.02)


def test_couplings_hold_in_a_fist(hand):
    hand.reset()
    command = hand.command_range[:, 0].copy()
    command[Channel.THUMB_ABDUCTION] = 0.7
    command[Channel.THUMB_FLEXOR] = 0.10
    hand.command(command)
    hand.advance(3.0)
    angles = hand.joint_angles()
    for first in (Joint.INDEX_PIP, Joint.MIDDLE_PIP, Joint.RING_PIP, Joint.PINKY_PIP, Joint.THUMB_MCP):
        assert angles[first + 1] == pytest.approx(angles[first], abs=0.03)


def test_reset_repeats_exactly(hand):
    traces = []
    for _ in range(2):
        hand.reset()
        command = hand.command_range.mean(axis=1)
        hand.command(command)
        hand.advance(0.3)
        traces.append(hand.lengths())
    assert np.array_equal(*traces)


def test_readings_belong_to_the_present(hand):
    """In motion, the readings are those of the present joint angles, without the sensors' one-step lag."""
    hand.reset()
    hand.command(hand.command_range.mean(axis=1))
    hand.advance(0.05)
    model = build_routed().compile()
    data = mujoco.MjData(model)
    data.qpos[:] = hand.joint_angles()
    mujoco.mj_forward(model, data)
    expected = [data.sensor(channel.label).data[0] for channel in Channel]
    assert hand.lengths() == pytest.approx(expected, abs=1e-12)


@settings(max_examples=15, deadline=None)
@given(hnp.arrays(float, (6, 7), elements=st.floats(0, 1)))
def test_any_commands_leave_the_hand_finite_and_within_its_stops(fractions):
    hand = RoutedHand()
    low, high = hand.command_range.T
    for fraction in fractions:
        hand.command(low + fraction * (high - low))
        hand.advance(0.1)
    angles = hand.joint_angles()
    assert np.all(np.isfinite(angles))
    assert np.all(angles > -0.15)
    assert np.all(angles < 1.95)


def test_thumb_regression_is_that_of_the_released_model():
    """A 10 x 10 sweep of the two thumb cables: joints over cable lengths, and CAD travel over each cable's length."""
    hand = RoutedHand()
    command = extended_command(hand)
    command[Channel.THUMB_ABDUCTION] = 0.8
    hand.command(command)
    hand.advance(1.0)
    lengths, angles = [], []
    flexor_goals = np.linspace(*hand.command_range[Channel.THUMB_FLEXOR][::-1], 10)
    for row, cmc in enumerate(np.linspace(*hand.command_range[Channel.THUMB_CMC_FLEXION][::-1], 10)):
        for flexor in flexor_goals if row % 2 == 0 else flexor_goals[::-1]:
            command[[Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR]] = cmc, flexor
            hand.command(command)
            hand.advance(0.6)
            lengths.append(hand.lengths()[[Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR]])
            angles.append(hand.joint_angles()[Joint.THUMB_CMC :])
    inputs, outputs = np.column_stack([lengths, np.ones(100)]), np.array(angles)
    rows, residuals, *_ = np.linalg.lstsq(inputs, outputs, rcond=None)
    r_squared = 1 - residuals / ((outputs - outputs.mean(axis=0)) ** 2).sum(axis=0)

    assert rows[:, 0] == pytest.approx([-77.8, -0.02, 2.995], abs=0.1)
    assert rows[:, 1] == pytest.approx([-12.2, -55.9, 6.63], rel=0.03)
    assert np.all(r_squared > [0.9997, 0.9991, 0.9991])
    cmc_travel = WINDING[Channel.THUMB_CMC_FLEXION][Joint.THUMB_CMC] * outputs[:, 0]
    flexor_travel = outputs @ [WINDING[Channel.THUMB_FLEXOR][Joint(j)] for j in range(Joint.THUMB_CMC, 16)]
    assert 1e3 * np.polyfit(inputs[:, 0], cmc_travel, 1) == pytest.approx([-972.5, 37.4], rel=2e-3)
    assert 1e3 * np.polyfit(inputs[:, 1], flexor_travel, 1) == pytest.approx([-1222.0, 135.2], rel=2e-3)
