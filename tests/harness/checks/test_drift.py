"""Pace at the end of a run: beside that of the start, with a supply that falls, and from any posture."""

import pytest

from aero.protocol import MAX_CODE
from hil.checks import ALIKE, EXPERIMENTS
from hil.checks.shared.experiment import record
from hil.emulated.any_hand import open_target

POSTURES = (0.0, 0.5, 1.0)


def rates(target, name):
    experiment = EXPERIMENTS[name]
    return experiment.measure(record(experiment, target))


@pytest.fixture(scope="module")
def hand():
    with open_target(seed=2) as target:
        yield target, rates(target, "response")


@pytest.mark.parametrize("posture", POSTURES)
def test_the_pace_does_not_depend_on_the_posture_before(hand, posture):
    """The experiment before left the fingers half closed, and each healthy hand seemed 6 % faster."""
    target, first = hand
    target.hand.command_codes([round(posture * MAX_CODE)] * 4 + [0] * 3)
    target.clock.sleep_until(target.clock.now() + 1.0)
    change = ALIKE.measure({"response": first, "drift": rates(target, "drift")})["hand"]["pace_change"]
    assert change == pytest.approx(0.0, abs=2.0)


def test_a_supply_that_falls_during_the_run_slows_the_hand(hand):
    target, first = hand
    target.inject("supply_low=0.28")
    change = ALIKE.measure({"response": first, "drift": rates(target, "drift")})["hand"]["pace_change"]
    target.clear("supply_low")
    assert -35.0 < change < -15.0
