"""Experiments on a guarded hand: they seek the stops without tripping it, and a stop is a finding."""

import numpy as np
import pytest
from drawn import drawn
from guarded_hands import close, guarded, torque_limits, wait

from aero import Channel
from aero.firmware import firmware_of
from aero.safety import SafetyStopError, Thresholds
from hil.checks.staircase.check import FULL, Staircase, run_staircase
from hil.emulated.any_hand import open_target
from hil.recordings.recorder import Recorder
from hil.verdict.run_end import FINISHED
from hil.verdict.validation import validate
from simulator import RoutedHand
from train.identification.excitation import REACH


def test_a_stop_in_an_experiment_is_a_finding_and_ends_the_validation():
    with guarded(thresholds=Thresholds(current_a=0.4, current_s=0.05)) as target:
        result = validate(target, ["audit", "replay"])
    assert not result.results
    assert "stopped and opened slowly" in result.end.finding.meaning
    assert result.session.header.safety["current_a"] == 0.4


def test_channels_that_meet_their_stops_are_weakened_for_it_and_no_longer():
    thresholds = Thresholds()
    with guarded() as target:
        target.begin(stops=[Channel.RING])
        close(target)
        wait(target, 0.1)
        weak, usual = thresholds.stop_torque, firmware_of("0.2.0").settings.torque
        assert torque_limits(target) == [weak, weak, weak, usual, usual, weak, usual]
        target.begin()
        close(target)
        wait(target, 0.1)
        assert torque_limits(target) == [weak] * 3 + [usual] * 4


@pytest.mark.parametrize("firmware", drawn(["0.1.0", "0.2.0"], 1))
def test_experiments_that_seek_the_stops_pass_a_guarded_healthy_hand(firmware):
    with guarded(firmware=firmware) as target:
        result = validate(target, ["audit", "excursion", "coupling", "response"])
    assert result.end.finding is None


def test_a_hand_that_cannot_be_weakened_is_not_pushed_into_its_stops():
    """Firmware `pre` has no torque limit, so the guard would stop the hand in the excursion."""
    with guarded(firmware="pre") as target:
        result = validate(target, ["audit", "excursion", "response"])
        close(target)
        wait(target, 0.5)
    assert list(result.results) == ["audit", "response"]
    assert result.end is FINISHED
    assert result.passed
    assert result.left_out == ("excursion",)
    assert "Not run, and not judged: excursion." in result.remark
    assert result.session.header.finished


def test_a_hand_of_which_nothing_may_be_run_does_not_pass():
    with guarded(firmware="pre") as target:
        result = validate(target, ["excursion"])
    assert result.end.finding.sentence.startswith("Hand: excursion not run")
    assert isinstance(result.end.error, SafetyStopError)
    assert not result.passed
    assert not result.diagnosis.suspects


def test_a_staircase_can_keep_away_from_the_stops():
    recorded = {}
    for name, reach in (("full", FULL), ("short", REACH)):
        with guarded(firmware="0.2.0") as target:
            recorder = Recorder(target, "staircase")
            run_staircase(target, recorder, RoutedHand(target.side), Staircase(levels=1, hold_s=0.1), reach=reach)
            recorded[name] = np.ptp(recorder.finish()["command"].values, axis=0)
    expected = [REACH[channel] for channel in Channel]
    np.testing.assert_allclose(recorded["short"] / recorded["full"], expected)


def test_a_hand_that_nobody_guards_may_be_pushed():
    with open_target(firmware="pre") as target:
        assert target.may_push_at_stops
