"""A healthy hand behind a host that is late: it is not stopped. A faulty one is, and the message says how late it was.

The hour of the figures in docs/safety.md: `BUSY_HOST_S=3600 pytest -m slow tests/safety/test_busy_host.py`.
"""

import os

import pytest
from guarded_hands import BusyHost, close, four_fingers_at_full_speed, guarded, wait

from aero import Channel
from aero.safety import SafetyStopError

FIRMWARES = ["pre", "0.1.0", "0.2.0"]
COOL = {"case_c_per_a2": 0.0, "motor_c_per_a": 0.0, "motor_c_per_count_per_s": 0.0}
"""Servos that stay cool: a physical hand would have to rest after some minutes of this."""
SECONDS = float(os.environ.get("BUSY_HOST_S", "120"))


def busy(target, *, late=0.05, lost=0.0, paused=0.0):
    link = target.wire._transport
    link.late, link.lost, link.paused = late, lost, paused


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_healthy_hand_is_not_stopped_because_the_host_is_late(firmware):
    with guarded(firmware=firmware, link=BusyHost) as target:
        close(target)
        busy(target, late=0.05, lost=0.01, paused=0.01)
        four_fingers_at_full_speed(target, 20.0)


@pytest.mark.slow
@pytest.mark.parametrize("firmware", FIRMWARES)
def test_an_hour_at_full_speed_with_late_readings_has_no_stop(firmware):
    with guarded(firmware=firmware, link=BusyHost, servos=COOL) as target:
        close(target)
        busy(target, late=0.05)
        four_fingers_at_full_speed(target, SECONDS)


@pytest.mark.slow
@pytest.mark.parametrize("firmware", FIRMWARES)
def test_an_hour_with_late_and_lost_readings_and_pauses_has_no_stop(firmware):
    with guarded(firmware=firmware, link=BusyHost, servos=COOL) as target:
        close(target)
        busy(target, late=0.03, lost=0.01, paused=0.01)
        four_fingers_at_full_speed(target, SECONDS)


def test_a_stop_on_a_busy_host_says_how_late_it_was():
    heating = {"start_temperature_c": 60.0, "rest_temperature_c": 80.0, "cooling_s": 20.0}
    with guarded(servos=heating, link=BusyHost) as target:
        close(target, Channel.INDEX, share=0.5)
        busy(target, late=1.0)
        with pytest.raises(SafetyStopError, match=r"65 °C.*readings came up to 0\.\d+ s after they were asked"):
            wait(target, 10.0)


def test_a_stop_on_an_idle_host_does_not_blame_it():
    heating = {"start_temperature_c": 60.0, "rest_temperature_c": 80.0, "cooling_s": 20.0}
    with guarded(servos=heating) as target:
        close(target, Channel.INDEX, share=0.5)
        with pytest.raises(SafetyStopError) as stop:
            wait(target, 10.0)
    assert "busy" not in str(stop.value)
