"""The short staircase, on recordings made by hand."""

import math

import numpy as np
import pytest

from aero.channels import Channel
from hil.checks.staircase import short_staircase
from hil.recordings.recording import Recording, Series
from tests.support.synthetic import HEADER, LABELS, RANGES, UNITS

OPEN = np.array([0.11, 0.11, 0.11, 0.11, 0.0, 0.038, 0.112])
CLOSED = OPEN + RANGES * [-1, -1, -1, -1, 1, -1, -1]
STREAM = OPEN + short_staircase.STREAM * (CLOSED - OPEN)
T = 0.02 * np.arange(len(STREAM))


def recording(hand):
    series = {"command": STREAM, "model": STREAM, "hand": hand}
    return Recording(HEADER, {name: Series.of(LABELS, UNITS, T, values.copy()) for name, values in series.items()})


def lagging(tau_s):
    """A hand whose every reading, taken before the command of the same sample, lags by one time constant."""
    value, rows = STREAM[0], []
    for command in STREAM:
        rows.append(value)
        value = command + (value - command) * math.exp(-0.02 / tau_s)
    return np.array(rows)


@pytest.mark.parametrize("tau_s", [0.05, 0.08])
def test_the_rise_is_that_of_a_first_order_lag(tau_s):
    """Which takes ln 9 of its time constants from 10 to 90 %."""
    found = short_staircase.measure(recording(lagging(tau_s)))
    for label in LABELS:
        assert found[label]["rise_hand_ms"] == pytest.approx(1e3 * tau_s * math.log(9), rel=0.02)
        assert found[label]["tracking_rms"] == pytest.approx(0.0, abs=1.0 if label == "thumb_abduction" else 0.05)


def test_tracking_is_what_a_settled_hand_is_off_in_its_own_sweep():
    """Every channel 0.3 mm (mrad) long; the index 2 mm more while others move, which is not its own sweep."""
    hand = lagging(0.05) + 0.3e-3
    hand[T > 5.0, Channel.INDEX] += 2e-3
    found = short_staircase.measure(recording(hand))
    for label in LABELS:
        assert found[label]["tracking_rms"] == pytest.approx(0.3, abs=0.02)


def test_a_step_that_friction_swallows_does_not_count_for_the_rise_and_none_is_not_measurable():
    hand, expected = lagging(0.05), 50.0 * math.log(9)
    turning = (T >= 0.6 + 3 * 0.6) & (T < 0.6 + 4 * 0.6)
    hand[turning, Channel.INDEX] = hand[turning, Channel.INDEX][0] + np.linspace(0.0, 1e-4, turning.sum())
    assert short_staircase.measure(recording(hand))["index"]["rise_hand_ms"] == pytest.approx(expected, rel=0.03)
    hand[:, Channel.RING] = OPEN[Channel.RING]
    found = short_staircase.measure(recording(hand))["ring"]
    assert math.isnan(found["rise_hand_ms"])
    assert found["tracking_rms"] > 10.0


def test_a_recording_that_was_cut_short_is_refused():
    whole = recording(lagging(0.05))
    cut = {name: Series.of(s.columns, s.units, s.times[:500], s.values[:500]) for name, s in whole.series.items()}
    with pytest.raises(ValueError, match="cut short"):
        short_staircase.measure(Recording(HEADER, cut))


def test_each_channel_climbs_two_twentieths_above_a_loose_grasp_and_opens():
    """Twentieths as the paper's staircase; 0.6 s a level, half a minute in all."""
    parts = (STREAM - OPEN) / (CLOSED - OPEN)
    held = parts[30::30][:42].reshape(7, 6, 7)
    for channel, foot in enumerate((0.5, 0.5, 0.5, 0.5, 0.5, 0.3, 0.4)):
        np.testing.assert_allclose(held[channel, :, channel] - foot, [0, 0.05, 0.1, 0.05, 0, -foot], atol=1e-9)
        np.testing.assert_allclose(np.delete(held[channel], channel, axis=1), 0.0, atol=1e-9)
    assert len(STREAM) * 0.02 == pytest.approx(25.8)


def sampled(times):
    """The hand of one lag as a host sees it that reads at `times`."""
    stream = recording(lagging(0.05))
    fine = stream["hand"]
    values = np.stack([np.interp(times, fine.times, column) for column in fine.values.T], axis=1)
    return Recording(HEADER, {**stream.series, "hand": Series.of(LABELS, UNITS, times, values)})


def test_the_rise_of_a_host_that_was_late_in_all_steps_is_withheld():
    """Read every 40 ms, no rise is told; every 24 ms, which is within 25, all are."""
    late = short_staircase.measure(sampled(np.arange(0.0, T[-1], 0.04)))
    assert all("rise_hand_ms" not in late[label] for label in LABELS)
    assert all(np.isfinite(late[label]["tracking_rms"]) for label in LABELS)
    in_time = short_staircase.measure(sampled(np.arange(0.0, T[-1], 0.024)))
    assert all(in_time[label]["rise_hand_ms"] == pytest.approx(50.0 * math.log(9), rel=0.1) for label in LABELS)


def test_of_a_host_that_was_late_for_a_while_the_other_channels_are_told():
    """Late in the first sweep, the index's."""
    times = np.concatenate([np.arange(0.0, 4.2, 0.04), np.arange(4.2, T[-1], 0.02)])
    found = short_staircase.measure(sampled(times))
    assert "rise_hand_ms" not in found["index"]
    assert found["pinky"]["rise_hand_ms"] == pytest.approx(50.0 * math.log(9), rel=0.02)
