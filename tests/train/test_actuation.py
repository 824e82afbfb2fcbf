import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from aero.policy.running import RunSettings, slewed
from train import actuation
from train.actuation import IDEAL, ActuationRanges, Parameters

NOMINAL = np.array([0.09, 0.09, 0.09, 0.09, 0.75, 0.035, 0.1])
STEPS, STEP_S = 5, 0.01
small = st.floats(-0.005, 0.005)
targets = st.lists(small, min_size=7, max_size=7).map(lambda change: NOMINAL + change)


def params(lag_s=0.0, delay_s=0.0, offset=0.0, gain=1.0):
    return Parameters(np.array([lag_s]), np.array([delay_s]), np.full(7, offset), np.full(7, gain))


def drive(parameters, sequence, ranges=IDEAL):
    servo, rows = actuation.at_rest(NOMINAL), []
    for target in sequence:
        servo, controls = actuation.drive(servo, target, parameters, NOMINAL, steps=STEPS, step_s=STEP_S, ranges=ranges)
        rows.append(controls)
    return np.concatenate(rows)


@given(targets, targets)
def test_the_ideal_hand_holds_each_target_for_the_whole_period(first, second):
    controls = drive(params(), [first, second])
    np.testing.assert_allclose(controls, np.repeat([first, second], STEPS, axis=0), atol=1e-12)


@given(st.integers(0, 10))
def test_a_delay_of_whole_steps_shifts_the_commands(steps):
    sequence = [NOMINAL + 0.001 * (k + 1) for k in range(4)]
    ideal, late = drive(params(), sequence), drive(params(delay_s=steps * STEP_S), sequence)
    np.testing.assert_allclose(late, np.concatenate([np.tile(NOMINAL, (steps, 1)), ideal])[: len(ideal)], atol=1e-12)


@given(st.floats(0, 0.1))
def test_a_delay_costs_its_own_length_of_the_command_exactly(delay_s):
    controls = drive(params(delay_s=delay_s), [NOMINAL + 0.001] * 4)
    missed = (NOMINAL + 0.001 - controls).sum(axis=0) * STEP_S
    np.testing.assert_allclose(missed, 0.001 * delay_s, atol=1e-9)


@given(st.floats(0.005, 0.1))
def test_a_lag_is_first_order(lag_s):
    controls = drive(params(lag_s=lag_s), [NOMINAL + 0.001] * 3)
    t = STEP_S * np.arange(1, len(controls) + 1)
    np.testing.assert_allclose(controls[:, 0] - NOMINAL[0], 0.001 * (1 - np.exp(-t / lag_s)), atol=1e-9)


@given(st.floats(0, 0.05), st.floats(0, 0.1))
def test_no_command_moves_a_hand_faster_than_its_servo(lag_s, delay_s):
    wild = [NOMINAL + 0.02, NOMINAL - 0.02, NOMINAL + 0.02]
    controls = np.vstack([NOMINAL, drive(params(lag_s, delay_s), wild, ActuationRanges(speed_limit=True))])
    assert (np.abs(np.diff(controls, axis=0)) <= actuation.SPEED_LIMIT * STEP_S + 1e-12).all()


def test_a_command_is_slewed_as_the_loop_of_deployment_does():
    wild = [NOMINAL + 0.02, NOMINAL - 0.02, NOMINAL + 0.02]
    sent = drive(params(), wild, ActuationRanges(slewed=True))[::STEPS]
    codes_per_length = 1 / actuation.COUNT
    last, expected, most = NOMINAL, [], RunSettings.shaft_speed_rad_s * STEPS * STEP_S * 4096 / (2 * np.pi)
    for target in wild:
        last = slewed(last * codes_per_length, target * codes_per_length, most) / codes_per_length
        expected.append(last)
    np.testing.assert_allclose(sent, expected, rtol=2e-3)  # 12.9 rad/s there, 740°/s here


def test_the_released_environment_has_no_errors():
    """Every range has zero width, and leaves the travel as it is."""
    assert (IDEAL.lag_s, IDEAL.delay_s, IDEAL.gain) == ((0.0, 0.0), (0.0, 0.0), (1.0, 1.0))
    assert IDEAL.offset == ((0.0,) * 7,) * 2
    assert {IDEAL.speed_limit, IDEAL.slewed, IDEAL.counts} == {False}
