"""A computer that is held up is named before the hand is, and asks again."""

import time

import pytest

from aero.errors import LinkTimeoutError
from hil.targets.delays import NOTEWORTHY_S, DelayLog, Loop, held_up
from hil.targets.hand_errors import NoHandError
from hil.targets.opening import first_reading
from hil.view.feed import GIVE_WAY_S, Feed


class Hand:
    """A hand whose replies come too late the first times."""

    def __init__(self, in_vain: int) -> None:
        self.left = in_vain

    def read_codes(self) -> None:
        self.left -= 1
        if self.left >= 0:
            raise LinkTimeoutError("no reply")


@pytest.mark.parametrize(("late_s", "said"), [(0.0, False), (NOTEWORTHY_S / 2, False), (2 * NOTEWORTHY_S, True)])
def test_a_delay_that_can_hide_a_reply_is_said(late_s, said):
    log = DelayLog()
    log.add(late_s, Loop.PROGRAM)
    assert held_up(log).startswith("this computer was held up") == said


def test_a_busy_computer_asks_again_and_an_idle_one_does_not():
    busy, idle = DelayLog(), DelayLog()
    busy.add(0.5, Loop.PROGRAM)
    first_reading(Hand(2), busy, "port")
    with pytest.raises(NoHandError, match=r"^this computer was held up for 0.5 s.*no hand answers at 'port'"):
        first_reading(Hand(9), busy, "port")
    with pytest.raises(NoHandError, match=r"^no hand answers at 'port'"):
        first_reading(Hand(1), idle, "port")


def test_the_page_takes_fewer_frames_when_they_take_long_or_the_board_is_late(monkeypatch):
    pauses, spent = [], iter([0.0, 0.001, 1.0, 1.04, 2.0, 2.0001])

    class Ended:
        def wait(self, seconds):
            pauses.append(seconds)
            return len(pauses) > 3

    monkeypatch.setattr(time, "monotonic", lambda: next(spent))
    feed = Feed.__new__(Feed)
    feed._pause_s, feed._late_s, feed._ended = 1.0 / 30.0, 0.0, Ended()
    calls = []

    def send():
        calls.append(1)
        if len(calls) == 3:
            feed.give_way()

    feed._send = send
    feed._run()
    assert pauses == pytest.approx([1 / 30, 1 / 30, 0.8, GIVE_WAY_S], abs=1e-3)
