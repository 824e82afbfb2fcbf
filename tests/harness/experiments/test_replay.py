"""Open-loop replay and the whole run, on recordings made by hand."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

import model
from hil.experiments import homing, open_loop_replay, whole_run
from hil.experiments.excursion import stale
from hil.recordings.recording import Recording, Series
from hil.targets.wire_log import WireRecord
from tests.support.synthetic import HEADER, LABELS, UNITS, held


def test_delay_offset_and_shape_of_a_replay_are_told_apart():
    """The hand is the simulator 40 ms later and 2 mm (mrad) further."""
    t = 0.005 * np.arange(1801)
    wave = 0.01 * np.sin(2 * np.pi * 0.5 * t)[:, None] * np.ones(7)
    late = 0.01 * np.sin(2 * np.pi * 0.5 * (t - 0.04))[:, None] * np.ones(7) + 0.002
    series = {"model": Series.of(LABELS, UNITS, t, wave), "hand": Series.of(LABELS, UNITS, t, late)}
    found = open_loop_replay.measure(Recording(HEADER, series))
    swing = 2 * 10 * math.sin(math.pi * 0.5 * 0.04)
    for label in LABELS:
        assert found[label]["replay_delay"] == pytest.approx(40.0)
        assert found[label]["replay_offset"] == pytest.approx(2.0, abs=1e-3)
        assert found[label]["replay_shape"] == pytest.approx(0.0, abs=1e-3)
        assert found[label]["replay_rms"] == pytest.approx(math.hypot(2.0, swing / math.sqrt(2)), rel=0.02)


def test_lost_replies_and_stray_bytes_of_a_session_are_counted():
    """Of four requests one stays without a reply and one reply has three bytes too many."""
    wire = []
    for i, size in enumerate((16, 0, 19, 16)):
        wire.append(WireRecord(0.1 * i, "to_hand", bytes([0x22]) + bytes(15)))
        wire.append(WireRecord(0.1 * i + 0.01, "from_hand", bytes(size)))
    found = whole_run.measure(Recording(HEADER, {}, tuple(wire)))["hand"]
    assert found == pytest.approx({"lost_replies": 25.0, "stray_bytes": 750.0, "restarts": 0.0})


def test_one_repeated_reading_of_a_moving_finger_is_stale():
    """It goes 0, 10, 20, 20, 30, 40, 50 %: one of the two readings between motions is a repetition."""
    codes = np.zeros((7, 7))
    codes[:, 0] = np.array((0, 10, 20, 20, 30, 40, 50)) / 100 * 65535
    assert stale(0.02 * np.arange(7), codes) == pytest.approx(1 / 2)


def test_the_slowest_homing_is_the_homing_time():
    postures = np.zeros((3, 7))
    postures[1, [0, 1, 2, 3, 5, 6]] = 65535
    found = homing.measure(held("homing", postures, 0.9, slowest_s=12.5))
    assert found["hand"] == {"homing_time": 12.5}
    assert found["index"] == {"homing_spread": 0.0}


def test_the_papers_unit_accelerates_as_its_rise_times_say():
    """64 counts/s² a unit: fitted to the paper's rise times behind acceleration 255, as the unit file says."""
    unit = tomllib.loads((Path(model.__file__).parent / "units" / "paper.toml").read_text(encoding="utf-8"))
    assert unit["servos"]["acceleration_unit_counts"] == 64.0
