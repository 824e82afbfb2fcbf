"""Mismatches one at a time: each row departs from the first in what it says and in nothing else."""

from dataclasses import fields, replace

import numpy as np
import pytest
from policies import holding

from aero.policy.running import RunSettings
from model.units import load_unit
from train.evaluation.cube_trial import CoarseHand, run_trial, step_codes
from train.evaluation.mismatches import NO_MISMATCH, lost, mismatch_picture, over_mismatches


def differing(one, other):
    return {field.name for field in fields(one) if getattr(one, field.name) != getattr(other, field.name)}


def test_each_row_departs_from_none_in_one_thing():
    made = over_mismatches(1, seconds=15.0, seed=3)
    first = made[0]
    found = {
        case.name: differing(case.unit.hand, first.unit.hand)
        | differing(case.unit.servos, first.unit.servos)
        | differing(case.settings, first.settings)
        | differing(case.surroundings, first.surroundings)
        for case in made
    }
    single = {
        "abduction coupling": {"abduction_winding"},
        "flexor radius": {"winding_scale"},
        "cable lengths": {"cable_take_up"},
        "springs": {"spring_open", "spring_closed"},
        "friction": {"spool_friction", "cable_friction", "joint_friction"},
        "dead time of the servos": {"goal_delay_s"},
        "command a period late": {"one_period_late"},
        "window shift": {"assumed_firmware"},
        "whole degrees": {"step_rad"},
    }
    assert found == {NO_MISMATCH: set(), **single, "all of them": set().union(*single.values())}
    assert first.unit.hand.gravity == 9.81
    assert first.unit.servos.goal_delay_s == 0.0


@pytest.fixture(scope="module")
def one():
    return run_trial(holding(), load_unit("ideal"), settings=RunSettings(seconds=0.2, approach_s=0.2, wait_s=0.1))


def test_what_is_lost_is_counted_trial_by_trial(one, tmp_path):
    def turning(rates):
        return [replace(one, kept=True, alive_s=1.0, rotation_rad=rate) for rate in rates]

    base = np.linspace(0.2, 2.0, 20)
    rows = {
        NO_MISMATCH: turning(base),
        "friction": turning(base - 0.3 + 0.01 * np.cos(base)),
        "springs": turning(base[:2]),
    }
    none, friction, springs = lost(rows)
    assert (none.lost_rad_s, none.rate_rad_s) == (0.0, pytest.approx(1.1))
    assert friction.lost_rad_s == pytest.approx(0.3, abs=0.02)
    low, high = friction.interval
    assert low < friction.lost_rad_s < high
    assert high - low < 0.02
    assert np.isnan(springs.interval).all()
    mismatch_picture([none, friction, springs], tmp_path / "mismatches.png")
    assert (tmp_path / "mismatches.png").stat().st_size > 5_000


class Codes:
    """A hand that keeps what it is sent."""

    def __init__(self):
        self.sent = np.zeros(7, np.uint16)

    def read_codes(self):
        return self.sent

    def command_codes(self, codes):
        self.sent = np.asarray(codes)


def test_a_coarse_host_reads_and_writes_whole_steps():
    window = np.array([[0.0, np.radians(360.0)]] * 7)
    steps = step_codes(window, np.radians(1.0))
    np.testing.assert_allclose(steps, 65535 / 360)
    hand = CoarseHand(Codes(), steps)
    hand.command_codes([0, 90, 92, 65535, 65500, 182, 1000])
    np.testing.assert_array_equal(hand.hand.sent, [0, 0, 182, 65535, 65535, 182, 910])
    np.testing.assert_array_equal(hand.read_codes(), hand.hand.sent)
