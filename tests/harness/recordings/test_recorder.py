"""Everything in a recording counts from its beginning, is a copy, and can be read whatever happened meanwhile."""

import logging
from pathlib import Path

import numpy as np
import pytest
from full_disk import available, full_disk

from hil import open_target
from hil.recordings.errors import CannotBeWrittenError
from hil.recordings.mcap_file import read_recording
from hil.recordings.recorder import Recorder
from hil.recordings.recording import Series
from hil.targets.delays import Delay, Loop

CODES = np.arange(7.0)


@pytest.fixture
def target():
    with open_target() as opened:
        yield opened


@pytest.fixture
def begun(target, tmp_path):
    """A recorder that writes to a file."""
    recorder = Recorder(target, "presence", tmp_path / "a.mcap")
    recorder.begin()
    return recorder


def loggers():
    return [(logger.level, list(logger.handlers)) for logger in map(logging.getLogger, ("aero", "hil"))]


def test_samples_events_and_bytes_have_the_time_since_the_beginning(target):
    """It begins 2 s after the opening; a note comes 0.5 s later, a reading 0.25 s after that."""
    target.clock.sleep_until(target.clock.now() + 2.0)
    recorder = Recorder(target, "presence")
    recorder.begin()
    target.clock.sleep_until(recorder.start + 0.5)
    recorder.note("half a second")
    target.clock.sleep_until(recorder.start + 0.75)
    recorder.add("codes", target.clock.now(), target.hand.read_codes())
    recording = recorder.finish()
    assert recording.events[0].t == pytest.approx(0.5)
    np.testing.assert_allclose(recording["codes"].times, 0.75)
    assert recording.wire[0].t == pytest.approx(0.75)
    assert 0.75 < recording.wire[-1].t < 0.8
    assert recording.header.duration_s == pytest.approx(recording.wire[-1].t, abs=0.01)


def test_a_row_is_copied(begun, tmp_path):
    row = np.zeros(7)
    for i in range(4):
        row[:] = i
        begun.add("codes", begun.start + i, row)
    recording = begun.finish()
    row[:] = 99.0
    np.testing.assert_array_equal(recording["codes"].values[:, 0], [0.0, 1.0, 2.0, 3.0])
    assert read_recording(tmp_path / "a.mcap") == recording


def test_a_series_copies_what_it_is_given():
    times, values = np.zeros(2), np.zeros((2, 1))
    made = [Series.of("x", "m", times, values), Series(("x",), ("m",), times, values)]
    times += 1.0
    values += 1.0
    for series in made:
        assert series.times.sum() == series.values.sum() == 0.0
        assert not series.values.flags.writeable


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_a_sample_that_is_not_finite_is_left_out_and_the_file_stays_readable(wrong, begun, tmp_path):
    for t, last in ((0.0, 6.0), (1.0, wrong), (2.0, wrong), (3.0, 7.0)):
        begun.add("codes", begun.start + t, np.append(CODES[:6], last))
    recording = begun.finish()
    assert recording["codes"].times.tolist() == [0.0, 3.0]
    assert [event.severity for event in recording.events] == ["warning"]
    assert "codes: a sample without finite numbers is left out" in recording.events[0].text
    assert read_recording(tmp_path / "a.mcap") == recording


@pytest.mark.parametrize(
    ("name", "t", "row"),
    [
        ("codes", 1.0, CODES[:6]),
        ("codes", 1.0, CODES[None]),
        ("codes", -1.0, CODES),
        ("codes", np.nan, CODES),
        ("codes", np.inf, CODES),
        ("codes", 0.5, CODES),
        ("toes", 1.0, CODES),
    ],
)
def test_what_no_series_can_hold_is_refused_and_the_file_stays_readable(name, t, row, begun, tmp_path):
    begun.add("codes", begun.start + 0.75, CODES)
    with pytest.raises(ValueError, match=r"a sample of codes has shape|there is no series"):
        begun.add(name, begun.start + t, row)
    recording = begun.finish()
    assert recording["codes"].times.tolist() == [0.75]
    assert read_recording(tmp_path / "a.mcap") == recording


@pytest.mark.skipif(not available, reason="needs a limit on the size of files")
def test_a_full_disk_closes_the_file_and_leaves_what_was_written(begun, target, tmp_path):
    before = len(target.wire.listeners)
    with full_disk(40_000):
        with pytest.raises(CannotBeWrittenError, match=r"a\.mcap"):
            fill(begun)
        target.hand.read_codes()  # the link is not the recorder's to end
        recording = begun.finish(ended=False)
    assert isinstance(begun.failure, CannotBeWrittenError)
    assert len(recording["codes"].times) > 100
    assert len(read_recording(tmp_path / "a.mcap")["codes"].times) > 100
    assert len(target.wire.listeners) == before - 1
    assert not [name for name in open_files() if name.endswith("a.mcap")]


@pytest.mark.skipif(not available, reason="needs a limit on the size of files")
def test_a_disk_that_is_full_at_the_end_closes_the_file_too(begun):
    begun.add("codes", begun.start, CODES)
    with full_disk(10):
        assert begun.finish().series.keys() == {"codes"}
    assert isinstance(begun.failure, CannotBeWrittenError)
    assert not [name for name in open_files() if name.endswith("a.mcap")]


def test_finishing_lets_go_of_logs_and_link(target, tmp_path):
    before, listeners = loggers(), len(target.wire.listeners)
    recorder = Recorder(target, "presence", tmp_path / "a.mcap")
    recorder.begin()
    assert loggers() != before
    recorder.finish(ended=False)
    assert loggers() == before
    assert len(target.wire.listeners) == listeners


def test_delays_of_both_loops_are_recorded(begun, target, tmp_path, monkeypatch):
    """A log of real time; the hand of this test has a clock of its own, so its delays are set."""
    delays = (Delay(0.5, 0.08, Loop.PROGRAM), Delay(2.0, 0.03, Loop.BOARD))
    monkeypatch.setattr(type(target.delays), "since", lambda self, start: delays)
    recording = begun.finish()
    assert read_recording(tmp_path / "a.mcap") == recording
    assert recording.delays == delays
    assert recording.longest_delay(0.0, 3.0) == delays[0]
    assert recording.longest_delay(1.0, 1.98) == delays[1]
    assert recording.longest_delay(0.3, 0.45) == delays[0]
    assert recording.longest_delay(0.6, 1.5) is None


def test_nothing_is_late_on_virtual_time(begun, target):
    target.clock.sleep_until(target.clock.now() + 5.0)
    target.hand.read_codes()
    recording = begun.finish()
    assert recording.delays == ()
    assert "delays" not in recording.series


def fill(recorder):
    for i in range(10_000):
        recorder.add("codes", recorder.start + i, np.random.default_rng(i).uniform(0, 60_000, 7))


def open_files():
    found = []
    for link in Path("/proc/self/fd").iterdir() if Path("/proc/self/fd").exists() else ():
        try:
            found.append(str(link.readlink()))
        except OSError:
            continue
    return found
