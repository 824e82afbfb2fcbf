"""The metrics give the textbook's answers on responses that have one."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import RANGES, replaced, staircase

from aero.channels import Channel
from hil.checks.shared.signals import at_times, find_steps
from hil.checks.staircase.rise_time import Response, median_rise, respond
from hil.checks.staircase.tracking import (
    details,
    quiet_command,
    quiet_trace,
    residual_sources,
    residuals,
    staircase_metrics,
)


@given(st.floats(0.02, 0.08), st.floats(1e-4, 1.0), st.booleans(), st.floats(0.0, 0.02))
def test_first_order_rise_is_2_197_time_constants(tau, size, down, delay):
    t = np.arange(0.0, 1.0, 0.001)
    sign = -1.0 if down else 1.0
    trace = sign * size * (1 - np.exp(-np.clip(t - delay, 0, None) / tau))
    (step,) = find_steps(t, np.outer(t > 0, [sign * size, 0, 0, 0, 0, 0, 0]))
    response = respond(step, t, trace)
    assert response.rise == pytest.approx(math.log(9) * tau, rel=1e-3)
    assert response.rise_on_grid == pytest.approx(math.log(9) * tau, abs=0.0011)
    assert response.overshoot == pytest.approx(0.0, abs=1e-6)
    assert response.answers(step)


@given(st.floats(0.2, 0.7), st.floats(60.0, 200.0))
def test_second_order_overshoot_is_the_textbooks(zeta, omega):
    t = np.arange(0.0, 1.0, 0.0005)
    damped = omega * math.sqrt(1 - zeta**2)
    trace = 1 - np.exp(-zeta * omega * t) * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t))
    (step,) = find_steps(t, np.outer(t > 0, [1.0, 0, 0, 0, 0, 0, 0]))
    expected = math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2))
    assert respond(step, t, trace).overshoot == pytest.approx(expected, rel=0.01, abs=2e-4)


def test_a_dead_trace_answers_nothing():
    t = np.arange(0.0, 1.0, 0.01)
    (step,) = find_steps(t, np.outer(t > 0.1, [0, 0, 1.0, 0, 0, 0, 0]))
    response = respond(step, t, np.zeros_like(t))
    assert math.isnan(response.rise)
    assert not response.answers(step)


def test_steps_end_where_any_channel_changes_next():
    t = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    command = np.zeros((5, 7))
    command[1:, 3] = 1.0
    command[3:, 6] = -2.0
    first, second = find_steps(t, command)
    assert (first.channel, first.start, first.end, first.before, first.after) == (3, 0.5, 1.5, 0.0, 1.0)
    assert (second.channel, second.start, second.end, second.after) == (6, 1.5, 2.0, -2.0)


def test_a_command_is_quiet_from_0_4_s_after_its_last_change():
    t = 0.02 * np.arange(100)
    command = np.zeros((100, 7))
    command[50:, 2] = 1.0
    quiet = quiet_command(t, command, t)
    assert np.flatnonzero(np.diff(quiet.astype(int))).tolist() == [19, 49, 69]


@given(st.lists(st.floats(-1, 1), min_size=1, max_size=40), st.floats(0.1, 10))
def test_a_quiet_trace_stays_in_its_band_for_100_ms(values, trace_range):
    t = 0.02 * np.arange(len(values))
    v = np.array(values)[:, None]
    expected = [np.ptp(v[max(0, i - 5) : i + 1]) <= 0.005 * trace_range for i in range(len(v))]
    assert quiet_trace(t, v, np.array([trace_range]))[:, 0].tolist() == expected


@given(st.floats(0.95, 1.05), st.floats(-0.02, 0.02))
def test_tracking_rms_is_gain_and_offset_error(gain, offset):
    recording = staircase(gain=gain, offset=offset, tau=0.02, hand_tau=0.02)
    rows = staircase_metrics(recording)
    _, settled = residuals(recording)
    for channel, row in rows.items():
        level = at_times(recording["command"].times, recording["command"].values, recording["hand"].times)
        error = ((gain - 1) * level[:, channel] + offset * RANGES[channel])[settled[:, channel]]
        assert row["tracking_rms"] == pytest.approx(1e3 * np.sqrt(np.mean(error**2)), abs=1e-6 * 1e3 * RANGES[channel])
        assert row["worst_percent"] * 10 * RANGES[channel] >= row["tracking_rms"] - 1e-9


def test_every_number_of_a_row():
    rows = staircase_metrics(staircase(levels=4, tau=0.03, hand_tau=0.05))
    for channel, row in rows.items():
        assert row["matched_steps"] == 8
        assert row["rise_model_ms"] == pytest.approx(1e3 * math.log(9) * 0.03, abs=10)
        assert row["rise_model_ms"] == pytest.approx(round(row["rise_model_ms"], -1))
        assert row["rise_hand_ms"] == pytest.approx(1e3 * math.log(9) * 0.05, rel=0.02)
        assert row["excursion_model"] == pytest.approx(1e3 * RANGES[channel], rel=1e-3)
        assert row["excursion_hand"] == pytest.approx(1e3 * RANGES[channel], rel=1e-3)
        # From 0.40 s to 0.47 s of each of 8 x 7 + 1 levels.
        assert row["settled_percent"] == pytest.approx(100 * 8 / 48)
        assert row["overshoot_hand_percent"] == pytest.approx(0.0, abs=1e-9)


def test_a_channel_that_never_moves_is_no_staircase():
    recording = staircase(levels=1)
    command = recording["command"].values.copy()
    command[:, Channel.PINKY] = 0.0
    with pytest.raises(ValueError, match="pinky is never commanded"):
        staircase_metrics(replaced(recording, "command", command))


@pytest.mark.parametrize("sweep", [Channel.RING, Channel.PINKY])
def test_the_worst_residual_is_told_with_its_time(sweep):
    """A hand that is perfect but for one settled sample of the ring, 0.3 % of its range short."""
    perfect = staircase(tau=0.02, hand_tau=0.02)
    row = 48 * (1 + 8 * sweep + 3) + 45
    hand = perfect["hand"].values.copy()
    hand[row, Channel.RING] -= 0.003 * RANGES[Channel.RING]
    found = staircase_metrics(replaced(perfect, "hand", hand))
    worst = 3 * RANGES[Channel.RING]
    assert found[Channel.RING]["worst_percent"] == pytest.approx(0.3)
    assert found[Channel.RING]["worst_residual_at_s"] == pytest.approx(0.01 * row)
    assert found[Channel.RING]["tracking_rms"] == pytest.approx(worst / math.sqrt(8 * 57))
    assert found[Channel.INDEX]["worst_percent"] == pytest.approx(0.0, abs=1e-9)


def test_excursions_are_those_of_the_channels_own_sweep():
    """The ring stands 60 mm further while the index is swept, which does not count."""
    still = staircase(tau=0.02, hand_tau=0.02)
    n = len(still["hand"].times)
    before = (np.arange(n) < 48 * 7)[:, None] * (np.arange(7) == Channel.RING)
    moved = replaced(still, "travel", still["travel"].values + 0.060 * before)
    moved = replaced(moved, "model", still["model"].values + 0.060 * before)
    for name in ("excursion_hand", "excursion_model"):
        assert staircase_metrics(moved)[Channel.RING][name] == pytest.approx(46.0, rel=1e-3)


def test_of_a_host_that_is_late_now_and_then_the_steps_in_time_count():
    """A rise reads 0.05 s in steps that were sampled every 20 ms, and longer in others; of four steps one is enough."""
    in_time, late = Response(1.0, 0.05, 0.06, 0.0, gap=0.0249), Response(1.0, 0.08, 0.06, 0.0, gap=0.0251)
    assert median_rise([in_time, *[late] * 3]) == 0.05
    assert median_rise([Response(1.0, rise, 0.06, 0.0, gap=0.02) for rise in (0.04, 0.05, 0.09)]) == 0.05
    assert math.isnan(median_rise([in_time, *[late] * 4]))
    assert math.isnan(median_rise([]))


@pytest.mark.parametrize(("period_s", "told"), [(0.01, True), (0.05, False)])
def test_a_staircase_that_the_host_sampled_late_has_no_rise(period_s, told):
    stream = staircase(levels=4, tau=0.03, hand_tau=0.05)
    hand = stream["hand"]
    times = np.arange(hand.times[0], hand.times[-1], period_s)
    values = np.stack([np.interp(times, hand.times, column) for column in hand.values.T], axis=1)
    rows = staircase_metrics(
        replace(stream, series={**stream.series, "hand": replace(hand, times=times, values=values)})
    )
    for row in rows.values():
        assert row["matched_steps"] == 8
        assert ("rise_hand_ms" in row) == told


@pytest.mark.parametrize("shaking", ["hand", "model"])
def test_what_shakes_is_not_settled(shaking):
    """Hand or simulator swings by 2 % of its range from sample to sample, under a quiet command."""
    recording = staircase()
    values = recording[shaking].values.copy()
    values[::2, 2] += 0.02 * RANGES[2]
    _, settled = residuals(replaced(recording, shaking, values))
    assert not settled[1:, 2].any()
    assert settled[:, 1].any()


def test_a_residual_is_hand_less_simulator():
    recording = staircase(tau=0.02, hand_tau=0.02, offset=0.01)
    residual, _ = residuals(recording)
    np.testing.assert_allclose(residual, np.broadcast_to(0.01 * RANGES, residual.shape), atol=1e-12)


@pytest.mark.parametrize(("series", "source"), [("hand", "hand"), ("model", "simulator"), ("goal", "map")])
def test_a_constant_error_is_attributed_to_its_source(series, source):
    perfect = staircase(tau=0.03, hand_tau=0.03)
    error = 0.02 * RANGES[Channel.RING]
    changed = perfect[series].values.copy()
    changed[:, Channel.RING] += error
    recording = replaced(perfect, series, changed)
    if series == "goal":
        recording = replaced(recording, "hand", perfect["hand"].values + error * (np.arange(7) == Channel.RING))
    found = residual_sources(recording)[Channel.RING]
    assert found[source] == pytest.approx(1e3 * error, rel=0.01)
    assert all(found[other] < 0.05 * found[source] for other in found if other != source)
    assert details(recording).rows[Channel.RING][2:] == tuple(f"{value:.2f}" for value in found.values())
