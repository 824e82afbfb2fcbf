"""The wait for hot servos after a homing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from aero.errors import LinkTimeoutError
from aero.safety import SafetyStopError, Thresholds
from aero.safety.cooling import HOT_C, let_cool
from firmware_emulator.kernel import Kernel, VirtualClock
from hil.emulated.any_hand import open_target
from hil.verdict.limits import load_limits


@given(st.lists(st.floats(20.0, 90.0), min_size=7, max_size=7), st.floats(20.0, 60.0), st.floats(1.0, 300.0))
def test_only_a_hot_hand_is_waited_for_until_it_is_cool_or_a_minute_has_passed(start_c, room_c, time_constant_s):
    clock, said = VirtualClock(Kernel()), []

    def temperatures():
        return room_c + (np.array(start_c) - room_c) * np.exp(-clock.now() / time_constant_s)

    let_cool(temperatures, clock, lambda share, text: said.append((share, text)))
    assert (clock.now() > 0.0) is bool(said) is (max(start_c) > 60.0)
    if said:
        assert temperatures().max() <= 52.0 or clock.now() == 60.0
    assert all(0.0 <= share < 1.0 for share, _ in said)


def test_what_is_waited_for_is_judged_as_hot_and_stops_no_guarded_hand():
    [judged] = [
        one.at_most for one in load_limits("0.2.0") if (one.experiment, one.metric) == ("presence", "temperature")
    ]
    assert HOT_C == judged < Thresholds().temperature_c


def test_temperatures_that_do_not_arrive_end_the_wait():
    def silent():
        raise LinkTimeoutError("no reply")

    clock = VirtualClock(Kernel())
    let_cool(silent, clock)
    assert clock.now() == 0.0


@pytest.mark.parametrize("firmware", ["0.1.4", "0.2.0"])
def test_a_homing_with_a_dead_finger_stops_no_guarded_hand_for_its_heat(firmware):
    """The other fingers press against their stops until the homing gives up: 69 °C, and the guard's limit is 65."""
    faults = ["motor_dead:ring"]
    with open_target(unit="plausible:5", seed=5, firmware=firmware, faults=faults, homed=True) as target:
        assert target.hand.read_temperatures().max() > 65.0
    with (
        pytest.raises(SafetyStopError, match=r"The program ended.* ring is"),  # the dead finger cannot be opened
        open_target(unit="plausible:5", seed=5, firmware=firmware, faults=faults, homed=True, guarded=True) as target,
    ):
        celsius = target.hand.read_temperatures()
    assert celsius.max() <= 52.0
    assert celsius[Channel.INDEX] > celsius[Channel.RING]
