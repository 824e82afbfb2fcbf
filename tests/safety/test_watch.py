"""The rules that stop a hand, without a hand."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero import Channel
from aero.safety import SafetyReason, Thresholds
from aero.safety import watch as watching
from aero.safety.encoders import Reading

LIMITS = Thresholds()
OPEN = np.zeros(7)
SPANS = np.array([3278, 3278, 3278, 3278, 1138, 1183, 2980])
TELEMETRY_S = 0.012
channels = st.sampled_from(list(Channel))


def watched(thresholds, spans):
    return watching.Watch(thresholds, spans, TELEMETRY_S)


def look_at(watch, t, positions, currents, late_s=0.0):
    """Look at values that are in the program's hands `late_s` after they were asked for."""
    return watch.look(Reading(t - late_s, t, positions), currents)


def looks(watch, seconds, positions=OPEN, currents=OPEN, start=0.0):
    """Look every 40 ms; return the first violation with its time. The last digit of the currents is never still."""
    for i in range(round(seconds / LIMITS.look_s)):
        t = start + i * LIMITS.look_s
        violation = look_at(watch, t, positions, currents + 0.0065 * (i % 2))
        if violation:
            return t, violation
    return None


@given(channels, st.floats(4.01, 6.0), st.sampled_from([-1.0, 1.0]))
def test_current_over_the_limit_stops_within_the_time_limit_and_one_look(channel, amperes, sign):
    currents = OPEN.copy()
    currents[channel] = sign * amperes
    t, violation = looks(watched(LIMITS, SPANS), 1.0, currents=currents)
    assert LIMITS.current_s <= t < LIMITS.current_s + LIMITS.look_s
    assert (violation.reason, violation.channel) == (SafetyReason.CURRENT, channel)
    assert channel.label in violation.text
    assert "4 A" in violation.text


@given(st.lists(st.tuples(st.integers(1, 7), st.integers(1, 5)), min_size=1, max_size=10))
def test_peaks_shorter_than_the_time_limit_pass(peaks):
    """Bursts of up to seven looks, 0.28 s, with at least one quiet look between."""
    watch, t = watched(LIMITS, SPANS), 0.0
    for over, quiet in peaks:
        for amperes in [4.5] * over + [0.2] * quiet:
            assert look_at(watch, t, OPEN, np.full(7, amperes) + 0.001 * t) is None
            t += LIMITS.look_s


@given(channels)
def test_a_hot_servo_stops_at_the_limit_and_not_a_degree_below(channel):
    celsius = np.full(7, LIMITS.temperature_c - 1)
    assert watched(LIMITS, SPANS).temperatures(celsius) is None
    celsius[channel] += 1
    violation = watched(LIMITS, SPANS).temperatures(celsius)
    assert (violation.reason, violation.channel) == (SafetyReason.TEMPERATURE, channel)


def test_readings_that_repeat_to_the_last_digit_stop():
    watch = watched(LIMITS, SPANS)
    times = np.arange(0, 1, LIMITS.look_s)
    first = next(t for t in times if look_at(watch, t, OPEN, OPEN))
    assert LIMITS.stale_s < first < LIMITS.stale_s + 3 * LIMITS.look_s


def test_no_answer_stops_once_it_is_older_than_the_limit():
    watch = watched(LIMITS, SPANS)
    look_at(watch, 1.0, OPEN, OPEN)
    assert watch.unanswered(1.1, 1.1 + 0.99 * LIMITS.silent_s) is None
    violation = watch.unanswered(2.2, 1.1 + 1.25)
    assert (violation.reason, violation.channel) == (SafetyReason.SILENT, None)
    assert "not answered for 1.25 s" in violation.text


@given(
    st.lists(st.floats(0, 1), min_size=1, max_size=6),
    st.floats(0.02, 0.4),
    st.floats(0.0, 0.45),
    channels,
)
def test_a_hand_that_follows_as_late_and_as_short_as_a_healthy_one_passes(goals, lag_s, short, channel):
    """A first-order answer that stops short of closing by less than the limit, to any sequence of commands."""
    watch, position = watched(LIMITS, SPANS), 0.0
    watch.encoders.found(0.0, OPEN)
    for i in range(len(goals) * 25):
        t, goal = i * LIMITS.look_s, goals[i // 25]
        watch.encoders.commanded(t, np.where(np.arange(7) == channel, goal, 0.0))
        reachable = min(goal, 1.0 - short)
        step = (reachable - position) * min(1.0, LIMITS.look_s / lag_s)
        fastest = 8800 * LIMITS.look_s / SPANS[channel]
        position += min(max(step, -fastest), fastest)
        positions = np.where(np.arange(7) == channel, position, 0.0)
        assert look_at(watch, t, positions, np.full(7, 0.0065 * (i % 2))) is None


@given(channels, st.floats(0.0, 0.8), st.floats(0.16, 0.99))
def test_an_encoder_beyond_what_was_commanded_stops(channel, goal, excess):
    watch = watched(LIMITS, SPANS)
    watch.encoders.found(-1.0, np.full(7, goal))
    positions = np.full(7, goal)
    positions[channel] += excess
    t, violation = looks(watch, 1.0, positions)  # there from the first look on, so it did not jump
    assert t == pytest.approx(LIMITS.stray_s, abs=LIMITS.look_s)
    assert (violation.reason, violation.channel) == (SafetyReason.STRAY, channel)


@given(channels, st.floats(0.51, 1.0))
def test_an_encoder_that_does_not_follow_stops_when_the_slowest_firmware_would_have_arrived(channel, goal):
    watch = watched(LIMITS, SPANS)
    watch.encoders.found(0.0, OPEN)
    watch.encoders.commanded(0.0, np.where(np.arange(7) == channel, goal, 0.0))
    t, violation = looks(watch, 4.0)
    assert t < LIMITS.follow_s + LIMITS.stray_s + 2 * LIMITS.look_s
    assert (violation.reason, violation.channel) == (SafetyReason.STRAY, channel)


def test_nothing_is_expected_of_the_encoders_after_homing():
    watch = watched(LIMITS, SPANS)
    watch.encoders.found(0.0, OPEN)
    watch.pause()
    assert looks(watch, 1.0, np.ones(7)) is None
    watch.encoders.commanded(1.0, OPEN)
    assert looks(watch, LIMITS.follow_s, np.ones(7), start=1.0) is None
    assert "stands at 100%" in looks(watch, 1.0, np.ones(7), start=1.0 + LIMITS.follow_s)[1].text


@pytest.mark.parametrize(("at", "cause"), [(0.0, "blocked or its servo has no torque"), (1.0, "its motor runs away")])
def test_a_stray_finger_is_blocked_or_runs_away(at, cause):
    watch = watched(LIMITS, SPANS)
    watch.encoders.found(0.0, OPEN)
    watch.encoders.commanded(0.0, np.full(7, 1.0 - at))
    # The first seconds pass on the way, without a look.
    text = looks(watch, 1.0, np.full(7, at), start=LIMITS.follow_s + 1.0)[1].text
    assert cause in text
    assert "home" not in text


def test_all_thresholds_are_listed_for_the_report():
    assert Thresholds(current_a=3.0).as_dict()["current_a"] == 3.0
    assert {*LIMITS.as_dict(), "forbidden"} == {field.name for field in dataclasses.fields(Thresholds)}


@given(channels, st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.04, 0.2))
def test_an_encoder_stops_the_hand_when_it_moves_faster_than_a_servo_can(channel, start, end, seconds):
    watch = watched(LIMITS, SPANS)
    for t, shares in ((0.0, OPEN), (0.0, np.ones(7))):
        watch.encoders.commanded(t, shares)
    begin, then = 10.0, OPEN.copy()
    then[channel] = start
    assert look_at(watch, begin, then, OPEN) is None
    now = then.copy()
    now[channel] = end
    assert look_at(watch, begin + seconds, now, OPEN + 0.1) is None
    violation = look_at(watch, begin + seconds + LIMITS.look_s, now, OPEN + 0.2)
    too_fast = abs(end - start) * SPANS[channel] / (seconds + TELEMETRY_S) > LIMITS.jump_counts_s
    assert (violation is not None and violation.reason is SafetyReason.JUMP) == too_fast


@given(channels, st.floats(0.0, 1.0), st.floats(0.5, 1.0))
def test_one_wrong_reading_does_not_stop_the_hand(channel, at, wrong_by):
    """A flipped bit: the next reading is where the hand is."""
    watch, there, wrong = watched(LIMITS, SPANS), OPEN.copy(), OPEN.copy()
    watch.encoders.found(9.0, OPEN)
    watch.encoders.commanded(9.5, np.ones(7))
    there[channel], wrong[channel] = at, (at + wrong_by) % 1.0
    for i, positions in enumerate([there, there, wrong, there, there, wrong, there]):
        assert look_at(watch, 10.0 + i * LIMITS.look_s, positions, OPEN + 0.1 * i) is None


@given(channels, st.floats(0.0, 0.1), st.floats(0.0, 0.1), st.floats(0.0, 0.5))
def test_late_readings_never_make_a_healthy_speed_too_fast(channel, late_before_s, late_s, paused_s):
    """A servo at its top speed; each value may be a telemetry period old, and in the program's hands late."""
    watch, then, now = watched(LIMITS, SPANS), OPEN.copy(), OPEN.copy()
    watch.encoders.found(9.0, OPEN)
    watch.encoders.commanded(9.5, np.ones(7))
    sampled, asked = 10.0 - TELEMETRY_S, 10.0 + late_before_s + LIMITS.look_s + paused_s
    now[channel] = min(1.0, 8800 * (asked + late_s - sampled) / SPANS[channel])
    assert watch.look(Reading(10.0, 10.0 + late_before_s, then), OPEN) is None
    assert watch.look(Reading(asked, asked + late_s, now), OPEN + 0.1) is None
    assert watch.look(Reading(asked + late_s + 0.04, asked + late_s + 0.04, now), OPEN + 0.2) is None


@given(channels, st.floats(0.11, 0.14))
def test_motion_without_a_command_stops_a_hand_at_rest(channel, moved):
    watch = watched(LIMITS, SPANS)
    watch.encoders.commanded(0.0, OPEN)
    assert looks(watch, 3.0) is None
    positions = np.where(np.arange(7) == channel, moved, 0.0)
    t, violation = looks(watch, 1.0, positions, start=3.0)
    assert t - 3.0 == pytest.approx(LIMITS.stray_s, abs=LIMITS.look_s)
    assert (violation.reason, violation.channel) == (SafetyReason.MOTION_AT_REST, channel)


def test_the_palm_may_push_a_blocked_thumb_while_another_channel_is_commanded():
    """CMC flexion rests against the palm, abduction moves away and lets it follow its old command."""
    watch, closed = watched(LIMITS, SPANS), OPEN.copy()
    closed[Channel.THUMB_CMC_FLEXION] = 1.0
    watch.encoders.commanded(0.0, closed)
    assert looks(watch, 4.0, 0.6 * closed) is None
    abducted = closed.copy()
    abducted[Channel.THUMB_ABDUCTION] = 1.0
    watch.encoders.commanded(4.0, abducted)
    for i, share in enumerate(np.linspace(0.6, 0.97, 10)):
        positions = abducted * np.where(np.arange(7) == Channel.THUMB_CMC_FLEXION, share, 0.1 * (i + 1))
        assert look_at(watch, 4.0 + i * LIMITS.look_s, positions, np.full(7, 0.1 * i)) is None


def test_one_window_a_channel_is_needed():
    with pytest.raises(ValueError, match=r"spans_counts needs 7.*\(3,\)"):
        watched(LIMITS, [1, 2, 3])
