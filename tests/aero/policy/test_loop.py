from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from policies import actions_on, playing, policy
from policy_strategies import seeds

from aero.actuation import ActuationMap
from aero.errors import LinkTimeoutError
from aero.policy.loop import run_policy
from aero.policy.running import NO_CORRECTION, Ending, RunSettings
from aero.policy.settings import PAPER_DEPLOYMENT, PAPER_TRAINING
from aero.policy.task import ShownAction, observe, targets
from aero.safety import SafetyStopError

MAP = ActuationMap()
SHORT = RunSettings(seconds=1.0, approach_s=0.5, wait_s=0.2, correction=NO_CORRECTION)
STEPS = 20


def asked_codes(step):
    return MAP.saturating_codes(MAP.angles_from_travel(MAP.travel_from_lengths(step.target))).codes


class StepClock:
    """Virtual time that only waiting moves."""

    def __init__(self) -> None:
        self.t = 0.0

    def now(self) -> float:
        return self.t

    def sleep_until(self, t: float) -> None:
        self.t = max(self.t, t)


class FakeHand:
    """A hand that reaches every command at once and notes when it was told what."""

    def __init__(self, clock: StepClock) -> None:
        self.clock = clock
        self.codes = np.array([100, 0, 300, 0, 0, 700, 0], np.uint16)
        self.written: list[tuple[float, np.ndarray]] = []
        self.currents = np.zeros(7)
        self.temperatures = np.full(7, 30.0)
        self.silent_after = np.inf
        self.read_takes_s = 0.0

    def read_codes(self):
        self.clock.t += self.read_takes_s
        if self.clock.t >= self.silent_after:
            raise LinkTimeoutError("no reply")
        return self.codes.copy()

    def command_codes(self, codes):
        codes = np.asarray(codes)
        assert codes.dtype == np.uint16
        self.written.append((self.clock.t, codes))
        self.codes = codes.copy()

    def read_currents(self):
        return self.currents

    def read_temperatures(self):
        return self.temperatures


def run(settings=SHORT, change=lambda hand: None, the_policy=None):
    clock = StepClock()
    hand, steps = FakeHand(clock), []
    change(hand)
    result = run_policy(the_policy or policy(), hand, clock, MAP, settings=settings, on_step=steps.append)
    return result, hand, steps


@given(st.lists(st.floats(-0.003, 0.003), min_size=7, max_size=7))
def test_a_correction_lengthens_what_is_commanded_and_shortens_what_is_read(values):
    _, _, steps = run(replace(SHORT, seconds=0.2, correction=tuple(values)))
    for step in steps:
        np.testing.assert_allclose(step.lengths, MAP.lengths_from_codes(step.codes) - values, atol=1e-12)
        asked = MAP.saturating_codes(MAP.angles_from_travel(MAP.travel_from_lengths(step.target + values))).codes
        np.testing.assert_array_equal(step.command[~step.limited], asked[~step.limited])


def test_the_policy_acts_twenty_times_a_second_for_the_time_asked():
    result, _, steps = run()
    assert (result.ending, result.steps, result.latest_s) == (Ending.TIME, STEPS, 0.0)
    np.testing.assert_allclose(np.diff([step.t for step in steps]), 0.05)


def test_each_step_is_read_mapped_observed_acted_mapped_written():
    the_policy = policy()
    _, _, steps = run(the_policy=the_policy)
    last_action = np.zeros(7)
    for step in steps:
        np.testing.assert_array_equal(step.lengths, MAP.lengths_from_codes(step.codes))
        np.testing.assert_array_equal(step.observation, observe(step.lengths, last_action))
        np.testing.assert_array_equal(step.action, the_policy.network.act(step.observation))
        np.testing.assert_array_equal(
            step.target, targets(step.action, *map(np.array, (PAPER_TRAINING.nominal, PAPER_TRAINING.scale)))
        )
        last_action = step.action
        np.testing.assert_array_equal(step.command[~step.limited], asked_codes(step)[~step.limited])


@given(seeds, st.sampled_from(ShownAction))
def test_a_replayed_recording_gives_the_same_actions(seed, shown):
    the_policy = policy(seed, shown)
    _, _, steps = run(the_policy=the_policy)
    replayed = actions_on(the_policy, np.array([step.lengths for step in steps]))
    np.testing.assert_array_equal(replayed, [step.action for step in steps])
    other = ShownAction.LAST if shown is ShownAction.BEFORE_LAST else ShownAction.BEFORE_LAST
    shifted = actions_on(replace(the_policy, shown_action=other), np.array([step.lengths for step in steps]))
    assert np.abs(shifted - replayed).max() > 1e-6


@given(seeds, st.floats(1.0, 20.0))
def test_no_command_ever_jumps_and_all_stay_in_range(seed, speed):
    settings = replace(SHORT, shaft_speed_rad_s=speed)
    _, hand, _ = run(settings, the_policy=policy(seed))
    codes = np.array([codes for _, codes in hand.written], float)
    window = MAP.window_rad
    angles = codes / 65535 * (window[:, 1] - window[:, 0])
    approach = np.abs(np.diff(angles[:10], axis=0)).max()
    assert (np.abs(np.diff(angles[10:30], axis=0)) <= max(speed * 0.05, approach) + 1e-3).all()
    assert codes.min() >= 0
    assert codes.max() <= 65535


def test_it_begins_and_ends_slowly_where_the_hand_was():
    _, hand, _ = run()
    home = FakeHand(StepClock()).codes
    codes = np.array([codes for _, codes in hand.written], float)
    nominal = np.round(MAP.codes_from_lengths(np.array(PAPER_TRAINING.nominal)))
    np.testing.assert_array_equal(codes[9], nominal)
    np.testing.assert_allclose(
        np.diff(np.vstack([home, codes[:10]]), axis=0), np.tile((nominal - home) / 10, (10, 1)), atol=1.1
    )
    np.testing.assert_array_equal(codes[-1], home)
    t = [t for t, _ in hand.written]
    assert t[10] == pytest.approx(0.7)


def test_a_dry_run_writes_nothing():
    result, hand, steps = run(replace(SHORT, dry=True))
    assert hand.written == []
    assert result.steps == len(steps) == STEPS


def test_a_command_can_be_a_period_late_like_the_official_nodes():
    def held(settings):
        return run(replace(settings, shaft_speed_rad_s=1e3), the_policy=policy(3))[2]

    on_time, late = held(SHORT), held(replace(SHORT, one_period_late=True))
    np.testing.assert_array_equal(late[0].command, MAP.codes_from_lengths(np.array(PAPER_TRAINING.nominal)))
    for before, step in pairwise(late):
        np.testing.assert_array_equal(step.command, asked_codes(before))
    assert (on_time[1].command != late[1].command).any()


def test_a_policy_can_be_shown_another_action_than_in_training():
    """The official node shows the last one, also to a policy that was trained with the one before."""
    the_policy = policy(3, ShownAction.BEFORE_LAST)
    _, _, own = run(SHORT, the_policy=the_policy)
    _, _, nodes = run(replace(SHORT, shown_action=ShownAction.LAST), the_policy=the_policy)
    np.testing.assert_array_equal(own[1].observation[7:], 0.0)
    np.testing.assert_array_equal(own[2].observation[7:], own[0].action)
    for before, step in pairwise(nodes):
        np.testing.assert_array_equal(step.observation[7:], before.action)


@pytest.mark.parametrize(("reach", "periods"), [((12,), 12), ((0,), 0), ((3, 5), 8)])
def test_periods_that_ask_for_more_than_the_window_are_counted(reach, periods):
    """The index's cable is asked for 30 mm more than the window has, in `reach` of the periods and then not."""
    beyond, inside = np.zeros(7), np.zeros(7)
    beyond[0] = -1.0
    far = replace(policy(), settings=replace(PAPER_TRAINING, scale=(0.05, *PAPER_TRAINING.scale[1:])))
    script = np.array([beyond] * sum(reach) + [inside] * (STEPS - sum(reach)))
    clock, steps = StepClock(), []
    result = run_policy(playing(script, far), FakeHand(clock), clock, MAP, settings=SHORT, on_step=steps.append)
    assert result.saturated == sum(step.saturated.any() for step in steps) == periods
    assert all(step.saturated.tolist() == [True] + [False] * 6 for step in steps[:periods])
    assert all(step.command[0] <= 65535 for step in steps)


def test_periods_that_the_shafts_speed_holds_back_are_counted():
    """At 1 rad/s a finger makes 0.45 mm a period: 20 mm take longer than the run, and 0.2 mm fit into one period."""
    slow = replace(SHORT, shaft_speed_rad_s=1.0)
    for action, periods in ((-1.0, STEPS), (-0.01, 0)):
        clock = StepClock()
        script = np.tile([action] + [0.0] * 6, (STEPS, 1))
        result = run_policy(playing(script), FakeHand(clock), clock, MAP, settings=slow)
        assert (result.limited, result.saturated) == (periods, 0)


def test_the_largest_current_of_either_sign_and_the_hottest_servo_are_kept():
    def strained(hand):
        hand.currents = np.array([0.1, -1.25, 0.0, 0.2, 0.0, 0.0, 1.0])
        hand.temperatures = np.array([30.0, 31.0, 47.0, 30.0, 30.0, 30.0, 30.0])

    result, _, _ = run(change=strained)
    assert (result.peak_current_a, result.peak_temperature_c) == (1.25, 47.0)


def test_other_settings_can_be_asked_for():
    _, _, steps = run(replace(SHORT, settings=PAPER_DEPLOYMENT))
    np.testing.assert_allclose(
        steps[0].target, np.array(PAPER_DEPLOYMENT.nominal) + np.array(PAPER_DEPLOYMENT.scale) * steps[0].action
    )


def silent(hand):
    hand.silent_after = 1.0


def blind(hand):
    def fail():
        raise LinkTimeoutError("no reply")

    hand.read_currents = fail


def slow(hand):
    hand.read_takes_s = 0.6


ENDINGS = [
    (Ending.READINGS, silent, 6),
    (Ending.READINGS, blind, 5),
    (Ending.OVERRUN, slow, 1),
]


@pytest.mark.parametrize(("ending", "change", "steps"), ENDINGS)
def test_what_a_hand_should_not_bear_ends_the_run_and_brings_the_hand_back(ending, change, steps):
    result, hand, _ = run(change=change)
    assert (result.ending, result.steps) == (ending, steps)
    np.testing.assert_array_equal(hand.written[-1][1], FakeHand(StepClock()).codes)


@pytest.mark.parametrize(("takes_s", "ending"), [(0.02, Ending.TIME), (0.055, Ending.TIME), (0.4, Ending.TOO_SLOW)])
def test_the_time_is_the_clocks_and_too_many_skipped_periods_are_no_success(takes_s, ending):
    result, _, steps = run(change=lambda hand: setattr(hand, "read_takes_s", takes_s))
    assert result.ending is ending
    assert steps[-1].t - steps[0].t < SHORT.seconds
    assert result.skipped == STEPS - len(steps)


@pytest.mark.parametrize("rate_hz", [0.5, 20.0, 1000.0])
def test_the_approach_has_a_rate_of_its_own(rate_hz):
    """At 0.5 Hz the way to the grasp was one jump of most of the window."""
    settings = replace(SHORT, settings=replace(PAPER_DEPLOYMENT, control_rate_hz=rate_hz), seconds=2.0)
    _, hand, _ = run(settings)
    times, codes = zip(*hand.written, strict=True)
    way = np.array([row for t, row in zip(times, codes, strict=True) if t <= times[0] + SHORT.approach_s], float)
    assert len(way) == 10
    assert np.abs(np.diff(way[:10], axis=0)).max() <= 1.05 * np.abs(way[9] - way[0]).max() / 9 + 1


def test_actions_beyond_the_clip_are_counted():
    result, _, _ = run(the_policy=playing(np.repeat([[2.5] * 7, [0.5] * 7], 10, axis=0)))
    assert result.clipped == 10


def test_a_missing_reading_commands_nothing_new():
    class Stutters(FakeHand):
        def read_codes(self):
            if 1.0 <= self.clock.t < 1.09:
                raise LinkTimeoutError("no reply")
            return super().read_codes()

    clock = StepClock()
    hand = Stutters(clock)
    result = run_policy(policy(), hand, clock, MAP, settings=SHORT)
    assert (result.ending, result.missing, result.steps) == (Ending.TIME, 2, STEPS - 2)
    assert not [t for t, _ in hand.written if 0.99 < t < 1.09]


def test_an_error_in_the_middle_still_brings_the_hand_back():
    def fail(step):
        if step.t > 1.0:
            raise KeyboardInterrupt

    clock = StepClock()
    hand = FakeHand(clock)
    with pytest.raises(KeyboardInterrupt):
        run_policy(policy(), hand, clock, MAP, settings=SHORT, on_step=fail)
    np.testing.assert_array_equal(hand.written[-1][1], FakeHand(StepClock()).codes)


def test_a_hand_that_its_guard_has_stopped_is_left_as_the_guard_left_it():
    class Stopped(FakeHand):
        def read_codes(self):
            if self.clock.t > 1.0:
                raise SafetyStopError("stopped: ring has drawn more than 4 A")
            return super().read_codes()

    clock = StepClock()
    hand = Stopped(clock)
    result = run_policy(policy(), hand, clock, MAP, settings=SHORT)
    assert result.ending is Ending.STOPPED
    assert "ring has drawn" in result.reason
    assert max(t for t, _ in hand.written) <= 1.0


def test_whoever_places_the_object_is_told_when_the_policy_begins():
    clock = StepClock()
    told, steps = [], []
    run_policy(
        policy(),
        FakeHand(clock),
        clock,
        MAP,
        settings=SHORT,
        on_ready=lambda: told.append(clock.t),
        on_step=steps.append,
    )
    assert told == [steps[0].t] == [pytest.approx(0.7)]
