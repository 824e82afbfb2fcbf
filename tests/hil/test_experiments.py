"""The experiments of `aero-hil validate`, with the same limits, on whatever hand is there."""

import dataclasses

import numpy as np
import pytest

from aero.channels import FINGERS, Channel
from hil.checks import DEFAULT, EXPERIMENTS
from hil.checks.staircase.stimulus import FULL, Staircase, run_staircase
from hil.checks.staircase.tracking import staircase_metrics
from hil.lab.system_identification.excitation import REACH
from hil.recordings.recorder import Recorder
from hil.verdict.findings import failed
from hil.verdict.validation import validate
from model import RoutedHand

pytestmark = pytest.mark.moves
QUICK = ("presence", "response")
SHORT = Staircase(levels=2, hold_s=0.6, lead_s=0.6)


SHORT_LIMITS = {
    **dict.fromkeys(FINGERS, (0.015, 2)),
    Channel.THUMB_ABDUCTION: (0.045, 2),
    Channel.THUMB_CMC_FLEXION: (0.09, 1),
    Channel.THUMB_FLEXOR: (0.04, 2),
}
"""Tracking RMS, share of the range, and matched steps of four. Greatest over twelve random hands (seeds 100 to 111),
each right with 0.2.0 and left with 0.1.5, and over the shipped units, all homed: 0.005, 0.029, 0.071 and 0.024. The
palm blocks CMC flexion in the upper half of its sweep, where two of its four steps are not answered."""
LONG = {name: [pytest.mark.takes_long] for name in DEFAULT if name not in QUICK}
LONG["staircase"].append(pytest.mark.slow)


@pytest.mark.parametrize("name", [pytest.param(name, marks=LONG.get(name, [])) for name in DEFAULT])
def test_within_limits(target, hand, name):
    if EXPERIMENTS[name].pushes_at_stops and not target.may_push_at_stops:
        pytest.skip(f"firmware {target.firmware} cannot weaken the thumb at its stops; run with --hil=emulated")
    result = validate(target, [name])
    assert result.stopped is None
    described = {(subject, metric.name) for metric in EXPERIMENTS[name].metrics for subject in metric.subjects}
    measured = result.results[name].measured
    assert described == {(subject, metric) for subject, row in measured.items() for metric in row}
    assert [f"{finding.sentence}. {finding.meaning}" for finding in failed(result.findings)] == []


def test_two_levels_on_every_channel(target, hand):
    """A staircase short enough for real time: simulator and hand agree on every channel."""
    target.begin(stops=Channel)
    recorder = Recorder(target, "staircase")
    reach = FULL if target.may_push_at_stops else REACH
    run_staircase(target, recorder, RoutedHand(target.side), SHORT, reach=reach)
    recording = recorder.finish()
    assert recording.header.target == target.name
    assert len(recording.wire) > 2 * len(recording["codes"].times)
    for channel, row in staircase_metrics(recording).items():
        span = np.ptp(recording["command"].values[:, channel]) * 1e3
        share, steps = SHORT_LIMITS[channel]
        assert row.matched_steps >= steps, channel
        assert row.tracking_rms < share * span, dataclasses.asdict(row)
        assert row.settled_samples > 20, channel


@pytest.mark.needs("ground_truth")
def test_the_encoders_tell_the_truth(target, hand, settle, open_codes):
    """They know how far a shaft has turned; where they count from is what homing found."""
    plant = target.capability("ground_truth")
    goal = open_codes.copy()
    start = target.map.angles_from_codes(settle(goal))[Channel.MIDDLE], plant.angles()[Channel.MIDDLE]
    goal[Channel.MIDDLE] = 40000
    end = target.map.angles_from_codes(settle(goal))[Channel.MIDDLE], plant.angles()[Channel.MIDDLE]
    assert (end[0] - start[0]) - (end[1] - start[1]) == pytest.approx(0.0, abs=np.deg2rad(1.0))
    assert np.all(plant.joint_angles()[3:6] > 0.2)


@pytest.mark.homes
@pytest.mark.takes_long
def test_homing_repeats(target, hand):
    """From here on the zero is the one that homing found; the plugin puts such tests last in any order."""
    result = validate(target, ["homing"])
    assert [finding.sentence for finding in failed(result.findings)] == []
