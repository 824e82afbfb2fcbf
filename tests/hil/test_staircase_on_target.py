"""A short staircase through the whole chain: simulator and hand agree on every channel."""

import dataclasses

import numpy as np

from aero.channels import Channel
from hil.experiments.staircase import Staircase, run_staircase
from hil.metrics import staircase_metrics
from model import RoutedHand

SHORT = Staircase(levels=2, hold_s=0.6, lead_s=0.6)


def test_two_levels_on_every_channel(target, hand):
    recording = run_staircase(target, RoutedHand(target.side), SHORT)
    assert recording.header.target == target.name
    assert len(recording.wire) > 2 * len(recording["codes"].times)
    for channel, row in staircase_metrics(recording).items():
        span = np.ptp(recording["command"].values[:, channel]) * 1e3
        assert row.matched_steps >= 2, channel
        assert row.tracking_rms < 0.06 * span, dataclasses.asdict(row)
        assert row.settled_samples > 20, channel


def test_ground_truth_agrees_with_the_encoders(target, hand, settle, capability, open_codes):
    plant = capability("ground_truth")
    goal = open_codes.copy()
    goal[Channel.MIDDLE] = 40000
    codes = settle(goal)
    angle = target.map.angles_from_codes(codes)[Channel.MIDDLE]
    assert abs(plant.angles()[Channel.MIDDLE] - angle) < np.deg2rad(1.0)
    joints = plant.joint_angles()[3:6]
    assert np.all(joints > 0.2)
