"""Presence, on a recording made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from hil.checks.presence import check as presence
from hil.checks.shared.exchanges import exchanges
from hil.recordings.recording import Recording, Series
from hil.targets.wire_log import WireRecord
from tests.support.synthetic import HEADER, LABELS

REQUEST = REPLY = bytes((0x22,)) + bytes(15)


def test_every_number_of_presence_is_the_recorded_one():
    """Three distinct currents of 30, peaks of 31 to 37 degC, one reply of four lost, trips of 1, 2 and 6 ms."""
    each, t = np.arange(1, 8), 0.025 * np.arange(30)
    currents = -0.1 * each * np.ones((30, 7))
    currents[3], currents[7] = 5.0, 6.0
    temperatures = np.full((30, 7), 30.0)
    temperatures[11] += each
    series = {
        "currents": Series.of(LABELS, ["A"] * 7, t, currents),
        "temperatures": Series.of(LABELS, ["degC"] * 7, t, temperatures),
    }
    wire = [WireRecord(0.1 * i, "to_hand", REQUEST) for i in range(4)]
    wire += [WireRecord(0.1 * i + trip, "from_hand", REPLY) for i, trip in enumerate((0.001, 0.002, 0.006))]
    header = replace(HEADER, experiment="presence", parameters={"boot_text": ""})
    found = presence.measure(Recording(header, series, tuple(sorted(wire))))
    for i, label in zip(each, LABELS, strict=True):
        assert found[label] == pytest.approx({"temperature": 30 + i, "idle_current": i / 10})
    expected = {"lost_replies": 25.0, "round_trip": 2.0, "distinct_readings": 3.0, "boot_contradictions": 0.0}
    assert found["hand"] == pytest.approx(expected)


def presence_of(wire=(), side="right", boot_text="", currents=None):
    t = 0.025 * np.arange(30)
    series = {
        "currents": Series.of(LABELS, ["A"] * 7, t, np.zeros((30, 7)) if currents is None else currents),
        "temperatures": Series.of(LABELS, ["degC"] * 7, t, np.full((30, 7), 30.0)),
    }
    header = replace(HEADER, side=side, experiment="presence", parameters={"boot_text": boot_text})
    wire = wire or (WireRecord(0.0, "to_hand", REQUEST), WireRecord(0.001, "from_hand", REPLY))
    return presence.measure(Recording(header, series, tuple(wire)))


def test_replies_count_when_they_are_complete_before_the_next_request():
    """Of five: in one piece, in two, too late, none, and too short."""
    pieces = ((0.001, 16), (0.002, 10), (0.003, 6), (0.109, 16), (0.302, 15))
    wire = [WireRecord(0.1 * i, "to_hand", REQUEST) for i in (0, 1, 2, 3, 4)]
    for i, (trip, size) in zip((0, 1, 1, 2, 1), pieces, strict=True):
        wire.append(WireRecord(0.1 * i + trip, "from_hand", REPLY[:size]))
    made = exchanges(sorted(wire))
    assert len(made) == 5
    trips = [one.completed - one.t for one in made if one.completed]
    assert trips == pytest.approx([0.001, 0.003, 0.009])
    found = presence_of(sorted(wire))["hand"]
    assert found["lost_replies"] == pytest.approx(40.0)
    assert found["round_trip"] == pytest.approx(3.0)


TEXT_0_1_4 = "Power-on detected\nHand Type: RIGHT_HAND\nPinging servos\n"


@pytest.mark.parametrize(
    ("text", "side", "contradictions"),
    [
        ("", "left", 0),
        ("Power-on detected\nHand Type: RIGHT_HAND\n", "right", 0),
        ("Power-on detected\n", "left", 0),
        ("Power-on detected\nHand Type: RIGHT_HAND\n", "left", 1),
        (TEXT_0_1_4, "right", 1),
        (f"{TEXT_0_1_4}ID 3: NO REPLY\nID 5: NO REPLY\n", "left", 4),
    ],
)
def test_what_the_boot_text_says_against_the_header_is_counted(text, side, contradictions):
    """The header says 0.2.0."""
    assert presence_of(side=side, boot_text=text)["hand"]["boot_contradictions"] == contradictions
