"""The rules that stop a hand, without a hand."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero import Channel
from aero.safety import Thresholds
from aero.safety.watch import Watch

LIMITS = Thresholds()
OPEN = np.zeros(7)
channels = st.sampled_from(list(Channel))


def looks(watch, seconds, positions=OPEN, currents=OPEN, start=0.0):
    """Look every 40 ms; return the first objection with its time. The last digit of the currents is never still."""
    for i in range(round(seconds / LIMITS.look_s)):
        t = start + i * LIMITS.look_s
        objection = watch.look(t, positions, currents + 0.0065 * (i % 2))
        if objection:
            return t, objection
    return None


@given(channels, st.floats(4.01, 6.0), st.sampled_from([-1.0, 1.0]))
def test_current_over_the_limit_stops_within_the_time_limit_and_one_look(channel, amperes, sign):
    currents = OPEN.copy()
    currents[channel] = sign * amperes
    t, objection = looks(Watch(LIMITS), 1.0, currents=currents)
    assert LIMITS.current_s <= t < LIMITS.current_s + LIMITS.look_s
    assert channel.label in objection
    assert "4 A" in objection


@given(st.lists(st.tuples(st.integers(1, 7), st.integers(1, 5)), min_size=1, max_size=10))
def test_peaks_shorter_than_the_time_limit_pass(peaks):
    """Bursts of up to seven looks, 0.28 s, with at least one quiet look between."""
    watch, t = Watch(LIMITS), 0.0
    for over, quiet in peaks:
        for amperes in [4.5] * over + [0.2] * quiet:
            assert watch.look(t, OPEN, np.full(7, amperes) + 0.001 * t) is None
            t += LIMITS.look_s


@given(channels)
def test_a_hot_servo_stops_at_the_limit_and_not_a_degree_below(channel):
    celsius = np.full(7, LIMITS.temperature_c - 1)
    assert Watch(LIMITS).temperatures(celsius) is None
    celsius[channel] += 1
    assert channel.label in Watch(LIMITS).temperatures(celsius)


def test_readings_that_repeat_to_the_last_digit_stop():
    watch = Watch(LIMITS)
    times = np.arange(0, 1, LIMITS.look_s)
    first = next(t for t in times if watch.look(t, OPEN, OPEN))
    assert LIMITS.stale_s < first < LIMITS.stale_s + 3 * LIMITS.look_s


def test_no_answer_stops_once_it_is_older_than_the_limit():
    watch = Watch(LIMITS)
    watch.look(1.0, OPEN, OPEN)
    assert watch.unanswered(1.0 + LIMITS.stale_s) is None
    assert "not answered for 0.25 s" in watch.unanswered(1.25)


@given(
    st.lists(st.floats(0, 1), min_size=1, max_size=6),
    st.floats(0.02, 0.4),
    st.floats(0.0, 0.45),
    channels,
)
def test_a_hand_that_follows_as_late_and_as_short_as_a_healthy_one_passes(goals, lag_s, short, channel):
    """A first-order answer that stops short of closing by less than the limit, to any sequence of commands."""
    watch, position = Watch(LIMITS), 0.0
    watch.found(0.0, OPEN)
    for i in range(len(goals) * 25):
        t, goal = i * LIMITS.look_s, goals[i // 25]
        watch.commanded(t, np.where(np.arange(7) == channel, goal, 0.0))
        reachable = min(goal, 1.0 - short)
        position += (reachable - position) * min(1.0, LIMITS.look_s / lag_s)
        positions = np.where(np.arange(7) == channel, position, 0.0)
        assert watch.look(t, positions, np.full(7, 0.0065 * (i % 2))) is None


@given(channels, st.floats(0.0, 0.8), st.floats(0.16, 0.99))
def test_an_encoder_beyond_what_was_commanded_stops(channel, goal, excess):
    watch = Watch(LIMITS)
    watch.found(0.0, np.full(7, goal))
    positions = np.full(7, goal)
    positions[channel] += excess
    t, objection = looks(watch, 1.0, positions)
    assert t == pytest.approx(LIMITS.stray_s, abs=LIMITS.look_s)
    assert channel.label in objection


@given(channels, st.floats(0.51, 1.0))
def test_an_encoder_that_does_not_follow_stops_when_the_slowest_firmware_would_have_arrived(channel, goal):
    watch = Watch(LIMITS)
    watch.found(0.0, OPEN)
    watch.commanded(0.0, np.where(np.arange(7) == channel, goal, 0.0))
    t, objection = looks(watch, 4.0)
    assert t < LIMITS.follow_s + LIMITS.stray_s + 2 * LIMITS.look_s
    assert channel.label in objection


def test_nothing_is_expected_of_the_encoders_after_homing():
    watch = Watch(LIMITS)
    watch.found(0.0, OPEN)
    watch.forget_commands()
    assert looks(watch, 1.0, np.ones(7)) is None
    watch.commanded(1.0, OPEN)
    assert looks(watch, LIMITS.follow_s, np.ones(7), start=1.0) is None
    assert "stands at 100%" in looks(watch, 1.0, np.ones(7), start=1.0 + LIMITS.follow_s)[1]


@pytest.mark.parametrize("field", [field.name for field in dataclasses.fields(Thresholds)])
@pytest.mark.parametrize("value", [0, -1, float("nan"), float("inf")])
def test_a_threshold_that_cannot_protect_is_refused(field, value):
    with pytest.raises(ValueError, match=f"{field} must be positive"):
        Thresholds(**{field: value})


@pytest.mark.parametrize(("field", "value"), [("gentle_speed", 32767), ("gentle_torque", 1024), ("limp_torque", 1024)])
def test_a_setting_that_the_board_would_change_is_refused(field, value):
    with pytest.raises(ValueError, match=f"the board stores .*{value}"):
        Thresholds(**{field: value})


def test_all_thresholds_are_listed_for_the_report():
    assert Thresholds(current_a=3.0).as_dict()["current_a"] == 3.0
    assert len(LIMITS.as_dict()) == len(dataclasses.fields(Thresholds))
