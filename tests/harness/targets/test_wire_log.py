"""The log of a link keeps the last records, and knows where it was."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.targets import wire_log
from hil.targets.wire_log import WireLog


class Clock:
    """Counts."""

    def __init__(self):
        self.t = 0.0

    def now(self):
        self.t += 1.0
        return self.t


class Sink:
    """Takes everything and sends nothing."""

    name = "sink"

    def write(self, data):
        pass


@given(st.integers(0, 12), st.integers(0, 12))
def test_what_came_after_a_mark_is_there_as_far_as_it_is_kept(before, after):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wire_log, "STORED_RECORDS", 5)
        log = WireLog(Sink(), Clock())
    for i in range(before):
        log.write(bytes([i]))
    mark = log.mark()
    for i in range(after):
        log.write(bytes([100 + i]))
    assert [record.data[0] for record in log.since(mark, 0.0)] == [100 + i for i in range(after)][-5:]
    assert len(log.since(0, 0.0)) == min(5, before + after)


def test_a_guards_thread_may_log_while_the_log_is_read(monkeypatch):
    log = WireLog(Sink(), Clock())
    for i in range(3):
        log.write(bytes([i]))
    real = wire_log.WireRecord

    def while_another_logs(*fields):
        monkeypatch.setattr(wire_log, "WireRecord", real)
        log.write(b"poll")
        return real(*fields)

    monkeypatch.setattr(wire_log, "WireRecord", while_another_logs)
    assert [record.data for record in log.since(1, 0.0)] == [bytes([1]), bytes([2])]


class Held:
    """Takes bytes late, or not at all."""

    name = "held"

    def __init__(self, clock, *, breaks=False):
        self.clock, self.breaks = clock, breaks

    def write(self, data):
        self.clock.t += 10.0
        if self.breaks:
            raise OSError("gone")


def test_bytes_are_logged_when_they_went_out_and_not_when_they_were_meant_to():
    clock = Clock()
    log = WireLog(Held(clock), clock)
    log.write(b"x")
    assert log.sent_at == 12.0
    assert [record.t for record in log.since(0, 0.0)] == [12.0]


def test_bytes_that_could_not_be_sent_are_in_the_log():
    clock = Clock()
    log = WireLog(Held(clock, breaks=True), clock)
    with pytest.raises(OSError, match="gone"):
        log.write(b"x")
    assert [record.data for record in log.since(0, 0.0)] == [b"x"]
