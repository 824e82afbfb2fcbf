"""The reference unit against what one physical hand measured.

Public logs June-July 2026, TTdragoAlex/tetherIA-aero-hand-open 58b518e; the runs themselves are not part of this
project, so their scores stand in docs/calibration.md.
"""

import numpy as np
import pytest

from aero.channels import FINGERS, Channel
from firmware_emulator.servo.electrical import CurrentLaw, Warmth
from hil.emulated.any_hand import open_target
from model.units import load_unit
from train.identification.trace import closing_current_sign

UNIT = load_unit("reference")
SPANS = np.array([3278, 3278, 3278, 3278, 1138, 1183, 2980])


@pytest.fixture
def target():
    with open_target("emulated") as opened:
        opened.clock.sleep_until(opened.clock.now() + 0.5)
        yield opened


def at(channel, share):
    codes = np.zeros(7, int)
    codes[channel] = round(share * 65535)
    return codes


def counts(target):
    return np.rint(target.hand.read_codes() * SPANS / 65535)


@pytest.mark.parametrize(("error", "milliamperes"), [(6, 30), (10, 30), (20, 37), (30, 43), (46, 50), (74, 45)])
def test_static_current_against_error(error, milliamperes):
    servo = UNIT.servos
    effort = error * servo.stall_torque * servo.duty_per_count
    assert 6.5 * CurrentLaw(servo).at_rest(effort) / error == pytest.approx(milliamperes, rel=0.1)


@pytest.mark.parametrize(
    ("start", "amperes", "speed", "seconds", "rise"),
    [
        pytest.param(28.5, 0.92, 0.0, 19.2, 3.0, id="CMC flexion holds a load"),
        pytest.param(43.5, 0.52, 1856.0, 15.6, 3.0, id="a finger of a policy that turns a cube"),
        pytest.param(31.5, 0.67, 3030.0, 6.5, 4.0, id="a finger at full steps, too cold"),
    ],
)
def test_heating(start, amperes, speed, seconds, rise):
    """Recorded rises between readings in whole degrees, with the speeds of the replays of these runs."""
    warm = Warmth(start).after(amperes, speed, seconds, UNIT.servos)
    assert sum(warm) - start == pytest.approx(rise, abs=2.3)


def test_idle_currents_at_the_open_hand_before_it_moves(target):
    """Recorded before the first motion of a run: fingers 0 to 0.4 A, CMC flexion 0.07 to 0.9 A."""
    currents = np.abs(target.hand.read_currents())
    assert np.all(currents[list(FINGERS)] <= 0.4)
    assert 0.07 <= currents[Channel.THUMB_CMC_FLEXION] <= 0.9


def test_idle_currents_of_fingers_that_have_closed_once(target):
    """Recorded after it on any day: 65 to 85 mA on the index, 0 to 26, 30 to 45 and 45 to 100 mA on the others."""
    codes = np.zeros(7, int)
    codes[list(FINGERS)] = 30000
    for command in (codes, np.zeros(7, int)):
        target.hand.command_codes(command)
        target.clock.sleep_until(target.clock.now() + 1.0)
    rest = np.mean([_after(target, 0.02) for _ in range(20)], axis=0)
    np.testing.assert_allclose(rest[list(FINGERS)], [0.075, 0.015, 0.035, 0.08], atol=0.06)


def _after(target, seconds):
    """Return what pulls closed, A, some time later."""
    target.clock.sleep_until(target.clock.now() + seconds)
    return closing_current_sign("right") * target.hand.read_currents()


def test_a_held_load_pulls_with_the_sign_of_the_register(target):
    for channel in (Channel.INDEX, Channel.THUMB_FLEXOR):
        target.hand.command_codes(at(channel, 0.5))
        target.clock.sleep_until(target.clock.now() + 1.0)
        # Positive pulls toward lower counts, which closes every channel of a right hand but the flexor.
        assert np.sign(target.hand.read_currents()[channel]) == (-1 if channel is Channel.THUMB_FLEXOR else 1)


@pytest.mark.parametrize("finger", FINGERS)
def test_fingers_stop_where_the_recorded_ones_do(target, finger):
    for share in np.arange(0.1, 1.01, 0.1):
        target.hand.command_codes(at(finger, share))
        target.clock.sleep_until(target.clock.now() + 0.2)
    target.clock.sleep_until(target.clock.now() + 0.5)
    assert 0.970 <= counts(target)[finger] / SPANS[finger] <= 0.985
    current = np.abs(target.hand.read_currents()[finger])
    assert current <= 700 * 6.5e-3


@pytest.mark.parametrize("finger", FINGERS)
def test_a_step_of_200_counts_takes_the_recorded_time(target, finger):
    """60-70 % done at 56 ms, 86-93 % at 85-90 ms, and 10 % more either way for the phase of the telemetry."""
    clock = target.clock
    target.hand.command_codes(at(finger, 0.2))
    clock.sleep_until(clock.now() + 0.6)
    for wait, low, high in ((0.056, 0.50, 0.80), (0.088, 0.80, 0.97)):
        before, start = counts(target)[finger], clock.now()
        target.hand.command_codes(at(finger, 0.2 + 200 / SPANS[finger]))
        clock.sleep_until(start + wait)
        done = (counts(target)[finger] - before) / 200.0
        assert low <= done <= high
        target.hand.command_codes(at(finger, 0.1))
        clock.sleep_until(clock.now() + 0.5)
        target.hand.command_codes(at(finger, 0.2))
        clock.sleep_until(clock.now() + 0.5)
