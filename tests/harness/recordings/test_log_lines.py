"""A recording takes in what the driver and the guard log while it is made, whatever the terminal shows."""

import logging
import threading

import pytest
from guarded_hands import close, guarded, wait

from aero.channels import Channel
from aero.safety import SafetyReason, SafetyStopError
from aero.safety.stop import Violation
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.recordings.mcap_file import read_recording
from hil.recordings.recorder import Recorder


def loggers():
    return [(logger.level, list(logger.handlers)) for logger in map(logging.getLogger, ("aero", "hil"))]


def test_requests_that_are_repeated_are_events_in_memory_and_on_disk(tmp_path):
    before = loggers()
    with open_target(faults=[parse_fault("reply_lost=0.2")]) as target:
        recorder = Recorder(target, "presence", tmp_path / "a.mcap")
        recorder.begin()
        for _ in range(30):
            target.hand.read_codes()
        recording = recorder.finish()
        for _ in range(30):
            target.hand.read_codes()
    repeated = [event for event in recording.events if "GET_POS, asked again" in event.text]
    assert 2 < len(repeated) < 20
    assert {event.severity for event in repeated} == {"info"}
    assert read_recording(tmp_path / "a.mcap").events == recording.events
    assert loggers() == before


def test_a_stop_is_an_event_of_its_time():
    with guarded() as target:
        close(target, Channel.INDEX, share=0.5)
        recorder = Recorder(target, "hold")
        recorder.begin()
        target.hand._guard.lookout.watch.temperatures = lambda _celsius: Violation(
            SafetyReason.TEMPERATURE, "it is hot"
        )
        with pytest.raises(SafetyStopError):
            wait(target, 2.0)
        (stop,) = recorder.finish(ended=False).events
    assert stop.severity == "warning"
    assert "stopped and opened slowly. it is hot" in stop.text
    assert 1.0 < stop.t < 6.0


def test_lines_of_another_thread_are_left_out():
    with open_target() as target:
        recorder = Recorder(target, "hold")
        recorder.begin()
        logging.getLogger("aero").info("mine")
        other = threading.Thread(target=logging.getLogger("aero").info, args=("another's",))
        other.start()
        other.join()
        logging.getLogger("hil.view").warning("%d mine too", 2)
        logging.getLogger("aero").debug("too small")
        assert [event.text for event in recorder.finish().events] == ["mine", "2 mine too"]
