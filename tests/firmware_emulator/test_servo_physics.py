import math
from itertools import pairwise
from random import Random

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from aero.safety.thresholds import Thresholds
from firmware_emulator.servo.electrical import CurrentLaw, Warmth, effort_limit
from firmware_emulator.servo.feedback import standard_normal
from firmware_emulator.servo.frame import Frame, Mounting
from firmware_emulator.servo.memory import decode_signed, encode_signed
from firmware_emulator.servo.models import HLS3606M as HLS3606M_REGISTERS
from firmware_emulator.servo.parameters import CURRENT_UNIT_MA, HLS3606M, RAD_PER_COUNT, ServoParameters
from firmware_emulator.servo.profile import plan

POSITIONS = st.floats(-2e4, 2e4)
VELOCITIES = st.floats(-1e4, 1e4)
SPEEDS = st.floats(50, 1e5)
ACCELERATIONS = st.floats(100, 25400)


@given(st.integers(-32767, 32767))
def test_sign_magnitude_words_come_back(value):
    assert decode_signed(encode_signed(value)) == value
    assert encode_signed(value) & 0x7FFF == abs(value)


@pytest.mark.parametrize("counts", [5, 10, 20, 30, 40, 46, 52])
def test_static_current_follows_the_recorded_curve_within_ten_percent(counts):
    recorded = {5: 30, 10: 30, 20: 37, 30: 43, 40: 47.5, 46: 50, 52: 50}
    effort = counts * HLS3606M.duty_per_count * HLS3606M.stall_torque
    assert CurrentLaw(HLS3606M).at_rest(effort) * 6.5 / counts == pytest.approx(recorded[counts], rel=0.1)


@given(st.integers(0, 1023), st.floats(0.005, 0.018))
def test_a_blocked_servo_reads_exactly_its_goal_torque_whatever_the_gain(units, duty_per_count):
    servo = ServoParameters(duty_per_count=duty_per_count)
    assert CurrentLaw(servo).at_rest(effort_limit(units, servo)) == pytest.approx(units, abs=1e-6)


TURNING = ServoParameters(current_turning_ma=13.2, current_fading_counts=1030.0)


@given(st.floats(0, 0.588), st.floats(0, 0.588), st.floats(-9000, 9000))
def test_a_turning_motors_current_rises_with_effort_and_knows_no_signs(first, second, speed):
    current = CurrentLaw(TURNING).turning
    low, high = sorted((first, second))
    assert current(low, speed) <= current(high, speed) + 1e-9
    assert current(-high, -speed) == current(high, speed)


@pytest.mark.parametrize(
    ("counts", "speed", "milliamperes"), [(10, 0, 318), (10, 400, 415), (40, 400, 2203), (45, 4000, 1398)]
)
def test_a_slow_motor_draws_more_than_one_at_rest_and_a_fast_one_less(counts, speed, milliamperes):
    """The law's own figures; recorded are 40 mA a count at 200-1000 counts/s, and 29 above 4000 with 45 counts."""
    effort = counts * TURNING.duty_per_count * TURNING.stall_torque
    assert 6.5 * CurrentLaw(TURNING).turning(effort, speed) == pytest.approx(milliamperes, abs=1)


HEATS = st.builds(Warmth, st.floats(20, 80), st.floats(0, 30))
AMPERES, COUNTS_PER_S, SECONDS = st.floats(-5, 5), st.floats(-9000, 9000), st.floats(0, 4000)


@given(HEATS, AMPERES, COUNTS_PER_S, SECONDS, SECONDS)
def test_temperature_does_not_depend_on_how_often_it_is_updated(start, current, speed, first, second):
    once = start.after(current, speed, first + second, HLS3606M)
    twice = start.after(current, speed, first, HLS3606M).after(current, speed, second, HLS3606M)
    assert twice == pytest.approx(once, abs=1e-6)


@given(HEATS, AMPERES, COUNTS_PER_S, SECONDS)
def test_current_and_travel_heat_either_way_and_their_heats_add_up(start, current, speed, seconds):
    def warmed(amperes, counts_per_s):
        return sum(start.after(amperes, counts_per_s, seconds, HLS3606M))

    assert warmed(-current, -speed) == warmed(current, speed) >= warmed(0.0, 0.0) - 1e-9
    apart = warmed(current, 0.0) + warmed(0.0, speed) - warmed(0.0, 0.0)
    assert warmed(current, speed) == pytest.approx(apart, abs=1e-6)


CUT_C = HLS3606M_REGISTERS.places["max_temperature"].default


def test_the_guard_and_the_servo_know_the_same_cut():
    """Driver and emulator share no code, so each states the maker's 80 °C."""
    with pytest.raises(ValueError, match=f"at most {CUT_C}"):
        Thresholds(temperature_c=CUT_C + 0.1)
    assert Thresholds(temperature_c=float(CUT_C)).temperature_c == CUT_C


@pytest.mark.parametrize("start_c", [34.0, 38.0])
@pytest.mark.parametrize(("torque", "low_s", "high_s"), [(1000, 20, 20), (700, 120, 180), (600, 300, 420)])
def test_a_blocked_servo_cuts_out_at_the_makers_times(torque, low_s, high_s, start_c):
    """Maker's hardware FAQ (Chestnut-Robotics/aero-open-docs 5787526): "about" these times to 80 °C; within 30 %."""
    start, amperes = Warmth(start_c), torque * CURRENT_UNIT_MA / 1000.0

    def warmed(seconds):
        return sum(start.after(amperes, 0.0, seconds, HLS3606M))

    assert warmed(0.7 * low_s) < CUT_C < warmed(1.3 * high_s)


@pytest.mark.parametrize(
    ("amperes", "speed", "most_c"),
    [
        pytest.param(500 * CURRENT_UNIT_MA / 1000.0, 0.0, CUT_C, id="held at torque 500: more than 15 minutes (maker)"),
        pytest.param(1.1, 2 * 1.2 * 3278, 65.0, id="cycles of the paper at 1.2 Hz for 90 h"),
    ],
)
def test_a_servo_lasts_where_the_makers_does(amperes, speed, most_c):
    assert sum(Warmth(HLS3606M.rest_temperature_c).after(amperes, speed, 9e4, HLS3606M)) <= most_c


@given(POSITIONS, VELOCITIES, POSITIONS, SPEEDS, ACCELERATIONS)
def test_a_profile_is_continuous_keeps_its_limits_and_ends_at_rest_on_the_goal(x, v, goal, speed, acceleration):
    motion = plan(2.0, x, v, goal, speed=speed, acceleration=acceleration)
    assert motion.at(2.0) == (pytest.approx(x, abs=1e-6), pytest.approx(v if motion.end > 2.0 else 0.0, abs=1e-6))
    assert motion.at(motion.end) == (goal, 0.0)
    last = motion.at(math.nextafter(motion.end, 0.0))
    assert last[0] == pytest.approx(goal, abs=1e-3)
    span = motion.end - 2.0
    states = [motion.at(2.0 + span * step / 200) for step in range(201)]
    for (x0, v0), (x1, v1) in pairwise(states):
        assert abs(v1 - v0) <= acceleration * span / 200 * (1 + 1e-6) + 1e-3
        assert abs(v1) <= max(speed, abs(v)) * (1 + 1e-9) + 1e-6
        assert abs(x1 - x0) <= max(speed, abs(v)) * span / 200 * (1 + 1e-6) + 1e-3


@given(POSITIONS, st.floats(-1e4, 1e4), SPEEDS, ACCELERATIONS)
def test_a_profile_from_rest_takes_the_time_of_the_vendors_rule_and_does_not_overshoot(x, step, speed, acceleration):
    motion = plan(0.0, x, 0.0, x + step, speed=speed, acceleration=acceleration)
    distance = abs((x + step) - x)  # what is left of the step beside x
    cruise = min(speed, math.sqrt(distance * acceleration))
    expected = distance / cruise + cruise / acceleration if distance else 0.0
    assert motion.end == pytest.approx(expected, rel=1e-6, abs=1e-9)
    low, high = min(x, x + step), max(x, x + step)
    assert all(low - 1e-6 <= motion.at(motion.end * k / 50)[0] <= high + 1e-6 for k in range(51))


@given(st.tuples(POSITIONS, VELOCITIES), POSITIONS, SPEEDS, ACCELERATIONS, st.floats(0, 1))
def test_planning_again_on_the_way_changes_nothing(state, goal, speed, acceleration, share):
    x, v = state
    motion = plan(0.0, x, v, goal, speed=speed, acceleration=acceleration)
    t = motion.end * share
    again = plan(t, *motion.at(t), goal, speed=speed, acceleration=acceleration)
    assert again.end == pytest.approx(motion.end, rel=1e-4, abs=1e-4)


@given(st.sampled_from([-1, 1]), st.floats(-5000, 5000), st.floats(-30, 30), st.integers(0, 4095))
def test_calibration_makes_the_present_angle_read_the_value_and_shifts_all_else(direction, zero, angle, value):
    # On the edge between two counts the shift itself rounds one way or the other.
    assume(1e-6 < (zero + 0.5 + direction * angle / RAD_PER_COUNT) % 1.0 < 1.0 - 1e-6)
    frame = Frame(Mounting(0, direction, zero))
    before = frame.counts(angle + 100 * RAD_PER_COUNT) - frame.counts(angle)
    frame.calibrate(angle, value)
    assert frame.counts(angle) == value
    assert abs(frame.counts(angle + 100 * RAD_PER_COUNT) - value - before) <= 1
    assert -2048 <= frame.offset <= 2047
    frame.forget_turns(angle)
    assert frame.counts(angle) == value


@given(st.sampled_from([-1, 1]), st.floats(-5000, 5000), st.floats(-30, 30))
def test_a_frame_is_right_both_ways(direction, zero, angle):
    frame = Frame(Mounting(0, direction, zero))
    assert abs(frame.angle(frame.counts(angle)) - angle) <= 0.51 * RAD_PER_COUNT


@given(st.integers(), st.integers(0, 30))
def test_the_noise_is_that_of_the_standard_library(seed, count):
    noise, library = standard_normal(Random(seed)), Random(seed)
    assert [next(noise) for _ in range(count)] == [library.gauss(0.0, 1.0) for _ in range(count)]
