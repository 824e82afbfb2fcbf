"""A computer that is held up is told from a late link in the times of the bytes."""

from dataclasses import replace

import numpy as np
import pytest

from hil.checks.shared.lateness import held_up, part_late
from hil.recordings.recording import DELAYS, Recording, Series, delay_series
from hil.targets.delays import Delay, Loop
from hil.targets.wire_log import WireRecord
from tests.support.synthetic import HEADER, LABELS

PERIOD_S = 0.02
ASK, REPLY, COMMAND = b"\x22" + bytes(15), b"\x22" + bytes(15), b"\x11" + bytes(15)


def recording(late=(), slow=(), doubled=()):
    """Fifty readings and commands; `late` gives how long the program waited before some, `slow` the link after some.

    Of `doubled` rows the reply comes twice.
    """
    t, times, wire = 0.0, [], []
    for row in range(50):
        t = max(t, row * PERIOD_S) + dict(late).get(row, 0.0)
        times.append(t)
        trip = 0.001 + dict(slow).get(row, 0.0)
        wire += [WireRecord(t, "to_hand", ASK), WireRecord(t + trip, "from_hand", REPLY)]
        wire += [WireRecord(t + trip, "from_hand", REPLY)] * (row in doubled)
        trip += 0.08 * (row in doubled)
        wire.append(WireRecord(t + trip + 0.0005, "to_hand", COMMAND))
        t += trip + 0.0005
    codes = Series.of(LABELS, ["u16"] * 7, times, np.zeros((50, 7)))
    return Recording(HEADER, {"codes": codes}, tuple(wire))


def test_a_program_in_time_is_never_held_up():
    assert held_up(recording(), PERIOD_S) == ()
    assert held_up(recording(late=[(row, 0.01) for row in range(0, 50, 2)]), PERIOD_S) == ()


def test_a_program_that_waited_is_held_up_for_as_long():
    (one,) = held_up(recording(late=[(20, 0.08)]), PERIOD_S)
    assert one.by_s == pytest.approx(0.08, abs=0.002)
    assert one.t == pytest.approx(0.48)


def test_a_driver_that_waits_for_quiet_after_a_doubled_reply_is_not_held_up():
    assert held_up(recording(doubled=(10, 20, 30)), PERIOD_S) == ()


def test_many_slow_replies_of_a_computer_that_is_late_itself_are_its_own():
    """As found beside four spinning processes: 7 % of the replies of a board that was emulated on the same computer."""
    late_link = recording(slow=[(row, 0.08) for row in range(10, 40, 3)])
    noted = delay_series([Delay(t, 0.03, Loop.PROGRAM) for t in (0.3, 0.5, 0.7)])
    busy = replace(late_link, series={**late_link.series, DELAYS: noted})
    assert sum(one.by_s == pytest.approx(0.081) for one in held_up(busy, PERIOD_S)) == 10


def test_a_computer_that_is_late_by_little_each_time_is_late_throughout():
    """As found in a staircase beside four spinning processes: a quarter of the time, by 8 ms in the median."""

    def noted(by_s):
        delays = delay_series([Delay(0.02 * row, by_s, Loop.PROGRAM) for row in range(50)])
        run = recording()
        return replace(run, header=replace(run.header, duration_s=1.0), series={**run.series, DELAYS: delays})

    assert part_late(noted(0.008)) == pytest.approx(0.4)
    assert part_late(recording()) == 0.0


def test_one_slow_reply_is_a_computer_and_many_are_a_link():
    (one,) = held_up(recording(slow=[(20, 0.08)]), PERIOD_S)
    assert one.by_s == pytest.approx(0.081)
    assert held_up(recording(slow=[(row, 0.08) for row in range(10, 40, 3)]), PERIOD_S) == ()
