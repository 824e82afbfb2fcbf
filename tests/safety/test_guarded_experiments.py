"""Experiments on a guarded hand: they seek the stops without tripping it, and a stop is a finding."""

import pytest
from guarded_hands import close, guarded, torque_limits, wait

from aero import Channel
from aero.safety import Thresholds, usual_settings
from hil.validation import validate


def test_a_stop_in_an_experiment_is_a_finding_and_ends_the_validation():
    with guarded(thresholds=Thresholds(current_a=0.4, current_s=0.05)) as target:
        result = validate(target, ["audit", "replay"])
    assert not result.results
    assert "stopped and opened slowly" in result.stopped.meaning
    assert result.session.header.safety["current_a"] == 0.4


def test_channels_that_meet_their_stops_are_weakened_for_it_and_no_longer():
    thresholds = Thresholds()
    with guarded() as target:
        target.begin(stops=[Channel.RING])
        close(target)
        wait(target, 0.1)
        weak, usual = thresholds.stop_torque, usual_settings("0.2.0").torque
        assert torque_limits(target) == [weak, weak, weak, usual, usual, weak, usual]
        target.begin()
        close(target)
        wait(target, 0.1)
        assert torque_limits(target) == [weak] * 3 + [usual] * 4


@pytest.mark.parametrize("firmware", ["0.1.0", "0.2.0"])
def test_experiments_that_seek_the_stops_pass_a_guarded_healthy_hand(firmware):
    with guarded(firmware=firmware) as target:
        result = validate(target, ["audit", "excursion", "coupling", "response"])
    assert result.stopped is None
