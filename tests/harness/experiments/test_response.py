"""Response, on a recording made by hand: one sample a millisecond, readings refreshed every 10 ms."""

from dataclasses import replace

import numpy as np
import pytest

from aero.protocol import MAX_CODE
from hil.experiments import response
from hil.recordings.recording import Event, Recording, Series
from hil.targets.wire_log import WireRecord
from tests.support.synthetic import HEADER, LABELS

NUDGED_S, CYCLES_S, END_S = 0.3, 1.0, 2.5


def recorded(*, events=()):
    """Make a nudge of the ring at 0.3 s, seen 40 ms later, and three cycles of 0.5 s from 1 to 2.5 s."""
    t = np.round(0.001 * np.arange(round(END_S * 1000) + 1), 6)
    command, part = np.zeros((len(t), 7)), np.zeros((len(t), 7))
    command[(t >= NUDGED_S) & (t < CYCLES_S), 2] = 0.15
    refreshed = np.floor(np.round(t / 0.01, 6)) * 0.01
    part[:, 2] = np.where(refreshed < CYCLES_S, np.clip((refreshed - NUDGED_S - 0.03) / 0.2, 0, 0.15), 0)
    phase = (t - CYCLES_S) % 0.5
    cycling = t >= CYCLES_S
    command[cycling, :4] = (phase < 0.25)[cycling, None]
    moving = np.where(refreshed < CYCLES_S, 0.0, 1 - np.abs(1 - ((refreshed - CYCLES_S) % 0.5) / 0.25))
    part[cycling, :4] = moving[cycling, None]
    series = {
        "codes": Series.of(LABELS, ["u16"] * 7, t, np.round(part * MAX_CODE)),
        "command_codes": Series.of(LABELS, ["u16"] * 7, t, np.round(command * MAX_CODE)),
    }
    wire = tuple(
        record
        for start, trip in ((0.0, 0.002), (0.1, 0.003), (0.2, 0.009))
        for record in (WireRecord(start, "to_hand", bytes(16)), WireRecord(start + trip, "from_hand", bytes(16)))
    )
    return Recording(
        replace(HEADER, experiment="response", parameters={"cycles_from_s": CYCLES_S}), series, wire, events
    )


def test_delays_and_rate_are_the_recorded_ones():
    """40 ms to motion, 10 ms a reading, three cycles in 1.5 s, a median round trip of 3 ms."""
    found = response.measure(recorded())["hand"]
    assert found["command_to_motion"] == pytest.approx(40.0)
    assert found["telemetry_period"] == pytest.approx(10.0)
    assert found["open_close_rate"] == pytest.approx(2.0)
    assert found["round_trip"] == pytest.approx(3.0)
    assert found["longest_standstill"] == pytest.approx(9.0)
    assert found["backward_readings"] == 0.0


def test_one_reading_that_goes_back_is_counted_in_the_recording():
    """One new reading behind the one before it, and no other, makes the share positive."""
    recording = recorded()
    codes = recording["codes"].values.copy()
    codes[1130:1140, 0] = codes[1115, 0]
    series = recording["codes"]
    changed = Series.of(series.columns, series.units, series.times, codes)
    back = replace(recording, series={**recording.series, "codes": changed})
    assert 0.0 < response.measure(back)["hand"]["backward_readings"] < 5.0


def test_fingers_that_do_not_arrive_have_no_rate():
    """A warning says so in the recording."""
    found = response.measure(recorded(events=(Event(2.0, "warning", "the fingers did not arrive"),)))["hand"]
    assert np.isnan(found["open_close_rate"])


def test_the_longest_standstill_of_a_finger_on_its_way_counts():
    """A reading at 40 % is repeated for 30 ms; the others stand for 9 ms or less."""
    t = 0.001 * np.arange(100)
    part = np.zeros((100, 7))
    part[:, 0] = 0.2 + 0.05 * np.floor(np.arange(100) / 10)
    part[40:70, 0] = part[40, 0]
    found = response.standstills(t, part * MAX_CODE, np.full((100, 7), float(MAX_CODE)))
    assert max(found) == pytest.approx(0.029)


def test_one_new_reading_of_four_that_goes_back_is_a_quarter():
    """One finger goes 10, 20, 15, 25, 35 % on its way to closed; the others stand."""
    part = np.zeros((5, 7))
    part[:, 0] = (0.10, 0.20, 0.15, 0.25, 0.35)
    assert response.backward(part * MAX_CODE, np.full((5, 7), float(MAX_CODE))) == pytest.approx(0.25)
