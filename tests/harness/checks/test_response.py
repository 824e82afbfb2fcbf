"""Response, on a recording made by hand: one sample a millisecond, readings refreshed every 10 ms."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import FINGERS
from aero.protocol import MAX_CODE, Opcode
from hil.checks.response import check as response
from hil.checks.shared.signals import CommandStep
from hil.recordings.recording import Recording, Series
from hil.targets.wire_log import WireRecord
from tests.support.synthetic import HEADER, LABELS

NUDGED_S, CYCLES_S, END_S = 0.3, 1.0, 2.5
ON_ITS_WAY_S = 0.0005
"""Time from a request to its reading."""
ASKED = bytes([Opcode.GET_POS]).ljust(16, b"\0")


def recorded():
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
    wire = tuple(WireRecord(came - ON_ITS_WAY_S, "to_hand", ASKED) for came in t[1:])
    return Recording(replace(HEADER, experiment="response", parameters={"cycles_from_s": CYCLES_S}), series, wire)


def test_delays_and_rate_are_the_recorded_ones():
    """39 ms to motion, which the reading of 40 ms shows and the one before does not, both asked for 0.5 ms before;

    10 ms a reading, three cycles in 1.5 s."""
    measured = response.measure(recorded())
    assert measured["ring"]["standstill"] == pytest.approx(8.5)
    found = measured["hand"]
    assert found["command_to_motion"] == pytest.approx(39.0)
    assert found["telemetry_period"] == pytest.approx(10.0)
    assert found["open_close_rate"] == pytest.approx(2.0)


@pytest.mark.parametrize("finger", FINGERS)
def test_fingers_that_do_not_arrive_have_no_rate(finger):
    recording = recorded()
    codes = recording["codes"]
    short = codes.values.copy()
    short[:, finger] = 0.85 * short[:, finger]
    series = recording.series | {"codes": Series.of(codes.columns, codes.units, codes.times, short)}
    assert np.isnan(response.measure(replace(recording, series=series))["hand"]["open_close_rate"])


def test_an_answer_that_was_late_is_no_standstill():
    """The finger moves on every 10 ms, the host is held up for 50 ms with an answer on its way."""
    t = 0.01 * np.arange(12)
    came = np.where(t >= 0.05, t + 0.05, t)
    part = np.repeat([0.2, 0.3, 0.4, 0.5, 0.6, 0.7], 2)
    asked = np.append(t[0], came[:-1])
    codes, goals = part * MAX_CODE, np.full(12, float(MAX_CODE))
    assert max(response.standstills(asked, came, codes, goals)) == pytest.approx(0.0)
    assert max(response.standstills(came, came, codes, goals)) == pytest.approx(0.06)


def test_a_reading_was_asked_for_by_the_last_request_for_one_before_it():
    """Not by what the driver asks for while it waits for a late one."""
    sent = ((1.0, ASKED), (2.0, ASKED), (2.5, bytes([Opcode.GET_TEMP]).ljust(16, b"\0")))
    wire = (*(WireRecord(at, "to_hand", data) for at, data in sent), WireRecord(2.6, "from_hand", bytes(16)))
    assert response.asked_at(np.array([1.2, 1.9, 2.0, 5.0]), wire).tolist() == [1.0, 1.0, 2.0, 2.0]


def way(*percent):
    """Codes of a finger."""
    return np.array(percent) / 100 * MAX_CODE


def test_standstills_count_on_the_way_only():
    """A finger stands at 10, 50, 70 and 90 %, from one change to the next; 90 % is near its goal."""
    t = 0.01 * np.arange(14)
    readings, told = way(0, 10, 10, 50, 50, 50, 70, 70, 70, 70, 90, 90, 90, 95), way(*[100] * 14)
    assert response.standstills(t, t, readings, told) == pytest.approx([0.01, 0.02, 0.03])
    assert response.standstills(t, t, way(0, 4, 4, 4, 50, 50, 81, 81, 81, 97, 97, 98, 99, 100), told) == pytest.approx(
        [0.01]
    )
    back = way(100, 96, 96, 94, 94, 94, 60, 60, 21, 21, 19, 19, 10, 0)
    assert response.standstills(t, t, back, way(*[0] * 14)) == pytest.approx([0.02, 0.01, 0.01])


@pytest.mark.parametrize(
    ("percent", "closed", "opened"), [(90.1, True, False), (89.9, False, False), (5.9, False, True)]
)
def test_fingers_arrive_at_90_and_at_6_per_cent(percent, closed, opened):
    codes = np.append(np.full(4, round(percent / 100 * MAX_CODE)), [0, 0, 0])
    assert response._arrived(codes, closing=True) is closed
    assert response._arrived(codes, closing=False) is opened
    assert response._arrived(np.array([65535, 0, 65535, 0, 0, 0, 0]), closing=True) is False
    assert response._arrived(np.array([65535, 0, 65535, 0, 0, 0, 0]), closing=False) is False


@given(st.floats(0.001, 0.02), st.floats(0.0, 1.0), st.floats(2.0, 20.0))
def test_a_host_that_asks_seldom_reads_the_same_delay_to_within_half_its_period(period, phase, periods):
    delay = periods * period
    asked = (phase + np.arange(100)) * period
    step = CommandStep(channel=2, start=1.5 * period, end=1.0, before=0.0, after=0.15)
    codes = np.where(asked >= step.start + delay, 1000.0, 0.0)
    assert response.motion_after(step, asked, codes) == pytest.approx(delay, abs=period / 2 + 1e-9)
