"""Everything in a recording counts from its beginning, is a copy, and can be read whatever happened meanwhile."""

from pathlib import Path

import numpy as np
import pytest
from full_disk import available, full_disk

from hil.emulated.any_hand import open_target
from hil.recordings.errors import CannotBeWrittenError
from hil.recordings.mcap_file import read_recording
from hil.recordings.recorder import Recorder
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


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_a_sample_that_is_not_finite_is_left_out_and_the_file_stays_readable(wrong, begun, tmp_path):
    for t, last in ((0.0, 6.0), (1.0, wrong), (2.0, wrong), (3.0, 7.0)):
        begun.add("codes", begun.start + t, np.append(CODES[:6], last))
    recording = begun.finish()
    assert recording["codes"].times.tolist() == [0.0, 3.0]
    assert [event.severity for event in recording.events] == ["warning"]
    assert "codes: a sample without finite numbers is left out" in recording.events[0].text
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


def test_delays_of_both_loops_are_recorded(begun, target, tmp_path, monkeypatch):
    """A log of real time; the hand of this test has a clock of its own, so its delays are set."""
    delays = (Delay(0.5, 0.08, Loop.PROGRAM), Delay(2.0, 0.03, Loop.BOARD))
    monkeypatch.setattr(type(target.delays), "since", lambda self, start: delays)
    recording = begun.finish()
    assert read_recording(tmp_path / "a.mcap") == recording
    assert recording.delays == delays


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
