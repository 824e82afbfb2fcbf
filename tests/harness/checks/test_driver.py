"""Driver and map against an independent reading of the bytes, on bytes made by hand and on a driver with mistakes."""

import struct
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from aero.actuation import CALIBRATIONS, ActuationMap
from aero.channels import Channel
from aero.protocol import Opcode, make_refused
from hil.checks.driver import check as driver
from hil.checks.driver import independent_map
from hil.recordings.recording import Recording, Series
from hil.targets.wire_log import WireRecord
from tests.support.synthetic import HEADER, LABELS

CODES = [1000, 2000, 3000, 4000, 5000, 6000, 7000]
IN_WIRE_ORDER = [5000, 6000, 7000, 1000, 2000, 3000, 4000]
"""By servo ID: abduction, CMC flexion, flexor, index to pinky (aero-open-firmware d7bd82e, `HandConfig.h`)."""
CURRENTS_A = [0.0065, -0.0065, 0.013, 0.0, 0.65, -0.65, 6.5]
CURRENT_WORDS = [100, -100, 1000, 1, -1, 2, 0]
TEMPERATURES = [30, 31, 32, 33, 34, 35, 36]
TEMPERATURE_WORDS = [34, 35, 36, 30, 31, 32, 33]
QUIET = dict.fromkeys(("sent", "mapped", "mapped_bias", "mapped_back", "read_wrong"), pytest.approx(0.0))


def frame(opcode, words):
    return struct.pack("<BB7h" if min(words) < 0 else "<BB7H", opcode, 0, *words)


def series(unit, *rows):
    times, values = zip(*rows, strict=True)
    return Series.of(LABELS, [unit] * 7, times, np.array(values, float))


def good():
    """One reading of each kind and two commands, as the board's source has them."""
    wire = (
        WireRecord(0.10, "to_hand", frame(0x22, [0] * 7)),
        WireRecord(0.11, "from_hand", frame(0x22, IN_WIRE_ORDER)),
        WireRecord(0.12, "to_hand", frame(0x11, IN_WIRE_ORDER)),
        WireRecord(0.13, "to_hand", frame(0x24, [0] * 7)),
        WireRecord(0.14, "from_hand", frame(0x24, CURRENT_WORDS)),
        WireRecord(0.15, "to_hand", frame(0x25, [0] * 7)),
        WireRecord(0.16, "from_hand", frame(0x25, TEMPERATURE_WORDS)),
        WireRecord(0.20, "to_hand", frame(0x11, [0] * 7)),
    )
    recorded = {
        "codes": series("u16", (0.10, CODES)),
        "command_codes": series("u16", (0.12, CODES), (0.20, [0] * 7)),
        "currents": series("A", (0.14, CURRENTS_A)),
        "temperatures": series("degC", (0.16, TEMPERATURES)),
    }
    return Recording(HEADER, recorded, wire)


def changed(name, values):
    recording = good()
    old = recording[name]
    return replace(
        recording, series={**recording.series, name: Series.of(LABELS, old.units, old.times, np.array(values, float))}
    )


def test_a_command_whose_answer_never_came_is_compared_no_more():
    """A run that the link ended was no verdict but an error."""
    lengths = independent_map.lengths_of_codes(np.array([CODES], float), HEADER.window)
    recorded = {**good().series, "command": series("m", (0.12, lengths[0]))}
    assert driver.measure(replace(good(), series=recorded))["ring"]["mapped"] == pytest.approx(0.0, abs=1.0)


def test_a_command_from_before_the_oldest_bytes_of_a_log_that_forgets_is_not_missed():
    assert driver.measure(replace(good(), wire=good().wire[3:]))["hand"]["unsent"] == 0.0
    assert driver.measure(replace(good(), wire=(*good().wire[:2], *good().wire[3:])))["hand"]["unsent"] == 1.0


def test_bytes_that_say_what_was_commanded_are_right():
    found = driver.measure(good())
    assert found == {
        **dict.fromkeys(LABELS, QUIET),
        "hand": {"unsent": 0.0, "extra": 0.0, "limits": 0.0, "unasked": 0.0, "unclipped": 0.0},
    }


def test_the_order_of_the_channels_is_that_of_the_board():
    swapped = [CODES[1], CODES[0], *CODES[2:]]
    found = driver.measure(changed("command_codes", [swapped, [0] * 7]))
    assert [found[label]["sent"] for label in LABELS] == [1000, 1000, 0, 0, 0, 0, 0]
    assert [driver.measure(changed("codes", [swapped]))[label]["read_wrong"] for label in LABELS[:3]] == [1000, 1000, 0]


def test_a_command_that_is_sent_one_late_is_not_the_one_that_was_given():
    found = driver.measure(changed("command_codes", [[0] * 7, CODES]))
    assert [found[label]["sent"] for label in LABELS] == CODES


def test_a_command_that_no_frame_follows_is_unsent():
    recording = good()
    silent = replace(recording, wire=recording.wire[:-1])
    assert driver.measure(silent)["hand"]["unsent"] == 1.0


def test_the_first_of_two_rows_at_one_time_is_no_command():
    """An experiment notes where the hand stood just before its first command."""
    rows = series("u16", (0.12, [0] * 7), (0.12, CODES), (0.20, [0] * 7))
    assert driver.measure(replace(good(), series={"command_codes": rows}))["hand"]["unsent"] == 0.0


def test_a_command_that_is_sent_twice_is_one_too_many():
    recording = good()
    twice = replace(
        recording, wire=(*recording.wire[:3], WireRecord(0.125, *recording.wire[2][1:]), *recording.wire[3:])
    )
    assert driver.measure(twice)["hand"]["extra"] == 1.0


def set_speed(index, speed):
    return frame(0x31, [index, speed, 0, 0, 0, 0, 0])


@pytest.mark.parametrize(
    ("before", "after", "restored", "wrong"),
    [(0, 32766, 0, 0.0), (0, 16383, 0, 1.0), (100, 32766, 100, 0.0)],
    ids=["the firmware's own", "half", "the owner's before and after"],
)
def test_limits_are_those_that_a_validation_sets(before, after, restored, wrong):
    sent = [set_speed(3, before), driver.REFUSED_SETTING, set_speed(3, after), frame(0x11, CODES)]
    wire = [WireRecord(0.1 * i, "to_hand", data) for i, data in enumerate([*sent, set_speed(3, restored)])]
    assert driver.measure(Recording(HEADER, {}, tuple(wire)))["hand"]["limits"] == wrong


def test_the_refused_setting_is_that_of_the_driver():
    assert make_refused(Opcode.SET_TOR) == driver.REFUSED_SETTING


def test_currents_have_their_sign_and_scale_and_temperatures_are_whole_degrees():
    assert driver.measure(changed("temperatures", [np.add(TEMPERATURES, 1)]))["index"]["read_wrong"] == 1.0
    assert driver.measure(changed("currents", [np.abs(CURRENTS_A)]))["middle"]["read_wrong"] == pytest.approx(2.0)
    twice = driver.measure(changed("currents", [2 * np.array(CURRENTS_A)]))
    assert twice["thumb_flexor"]["read_wrong"] == pytest.approx(1000.0)


@pytest.mark.parametrize("t", [0.05, 0.0999, 0.1, 0.15])
def test_a_reading_is_noted_before_or_after_it_was_asked_for(t):
    recording = good()
    noted = Series.of(LABELS, ["u16"] * 7, [t], np.array([CODES], float))
    assert driver.measure(replace(recording, series={"codes": noted}))["index"]["read_wrong"] == 0.0
    wrong = Series.of(LABELS, ["u16"] * 7, [t], np.array([CODES], float) + 3.0)
    assert driver.measure(replace(recording, series={"codes": wrong}))["ring"]["read_wrong"] == 3.0


@given(st.binary(min_size=1, max_size=40))
def test_a_driver_is_not_judged_by_replies_of_a_link_that_is_out_of_order(noise):
    """Which frame it takes there is its own affair."""
    recording = changed("codes", [np.add(CODES, 5)])
    assert driver.measure(recording)["index"]["read_wrong"] == 5.0
    wire = list(recording.wire)
    wire[1] = wire[1]._replace(data=wire[1].data + noise)
    assert driver.measure(replace(recording, wire=tuple(wire)))["index"]["read_wrong"] == 0.0


LENGTHS = arrays(float, (1, 7), elements=st.floats(0.0, 1.0))
SHORTEST = np.array([0.0617776, 0.0621875, 0.0616733, 0.0637823, 0.0, 0.026, 0.09])
LONGEST = np.array([0.107723, 0.1084, 0.10775, 0.109504, 1.75, 0.038, 0.117])


@given(state=st.sampled_from(sorted(CALIBRATIONS)), parts=LENGTHS)
def test_the_map_and_the_paper_give_the_same_codes(state, parts):
    codec = ActuationMap.for_firmware("0.2.0", state)
    lengths = SHORTEST + parts * (LONGEST - SHORTEST)
    codes = codec.saturating_codes(codec.angles_from_travel(codec.travel_from_lengths(lengths))).codes
    assert np.abs(codes.astype(float) - independent_map.codes_of_lengths(lengths, state)).max() <= 1.0
    back = independent_map.lengths_of_codes(codes.astype(float), state)
    np.testing.assert_allclose(codec.lengths_from_codes(codes), back, atol=1e-9)


def test_the_map_is_judged_by_the_paper_and_one_that_was_fitted_is_not():
    lengths = np.array([[*LONGEST[:4], 0.5, 0.033, 0.1]])
    right = independent_map.codes_of_lengths(lengths, "homed")
    wrong = right + np.array([0, 0, 0, 0, 0, 40, 0])
    recorded = {
        "command": Series.of(LABELS, ["m"] * 7, [0.0], lengths),
        "command_codes": Series.of(LABELS, ["u16"] * 7, [0.0], wrong),
        "codes": Series.of(LABELS, ["u16"] * 7, [0.0], right),
        "hand": Series.of(LABELS, ["m"] * 7, [0.0], independent_map.lengths_of_codes(right, "homed") + 1e-3),
    }
    found = driver.measure(Recording(HEADER, recorded))
    assert [found[label]["mapped"] for label in LABELS] == [0, 0, 0, 0, 0, 40, 0]
    assert found["thumb_cmc_flexion"]["mapped_bias"] == 40.0
    assert found["index"]["mapped_back"] == pytest.approx(1.0)
    fitted = Recording(replace(HEADER, map="mine"), recorded)
    assert driver.measure(fitted)["thumb_cmc_flexion"] == QUIET


def test_the_window_is_that_of_the_board():
    """Abduction 0 to 100°, flexor from -15.28°; homing of 0.2.0 moves abduction 9.93° on and CMC flexion back."""
    np.testing.assert_allclose(independent_map.window_deg("unshifted")[Channel.THUMB_ABDUCTION], [0.0, 100.0])
    assert independent_map.window_deg("unshifted")[Channel.THUMB_FLEXOR][0] == pytest.approx(-15.2789, abs=2e-3)
    shift = independent_map.window_deg("homed") - independent_map.window_deg("unshifted")
    np.testing.assert_allclose(shift[[4, 5]], [[9.93, 9.93], [-9.93, -9.93]], atol=5e-3)
    assert independent_map.window_deg("mixed")[4][1] == pytest.approx(100.0)


def test_a_reading_whose_reply_came_late_is_compared_with_no_other():
    """A hub that stalled was told as a driver that returns wrong readings: the request of the late one was left out."""
    late = (
        *good().wire,
        *(WireRecord(0.3 + 0.01 * i, "to_hand", frame(0x25, [0] * 7)) for i in range(driver.AHEAD)),
        *(WireRecord(0.305 + 0.01 * i, "from_hand", frame(0x25, TEMPERATURE_WORDS)) for i in range(driver.AHEAD)),
        WireRecord(0.5, "to_hand", frame(0x24, [0] * 7)),
        WireRecord(0.6, "to_hand", frame(0x22, [0] * 7)),
        WireRecord(0.9, "from_hand", frame(0x24, [1] * 7)),
        WireRecord(0.9, "from_hand", frame(0x22, IN_WIRE_ORDER)),
    )
    late = tuple(sorted(late, key=lambda record: record.t))
    currents = series("A", (0.14, CURRENTS_A), (0.9, [0.0065] * 7))
    recording = replace(good(), wire=late, series={**good().series, "currents": currents})
    assert all(values["read_wrong"] == 0.0 for label, values in driver.measure(recording).items() if label != "hand")
