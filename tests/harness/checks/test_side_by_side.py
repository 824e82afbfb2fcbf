"""Simulator and hand stay on one time base, also on a machine that cannot keep up."""

import numpy as np
import pytest
from guarded_hands import BusyHost, guarded
from recorded import staircase_of

from aero.channels import FINGERS, Channel
from hil.checks.staircase.check import Staircase
from hil.checks.staircase.tracking import staircase_metrics
from hil.emulated.any_hand import open_target

SHORT = Staircase(levels=2, hold_s=0.6, lead_s=0.6)


class Busy:
    """The clock of a machine that is taken away from the program now and then."""

    def __init__(self, clock, every, seconds):
        self._clock, self._every, self._seconds, self._calls = clock, every, seconds, 0

    def now(self):
        return self._clock.now()

    def sleep_until(self, t):
        self._clock.sleep_until(t)
        self._calls += 1
        if self._calls % self._every == 0:
            self._clock.sleep_until(t + self._seconds)


def run(every=0, seconds=0.0):
    with open_target() as target:
        if every:
            object.__setattr__(target, "clock", Busy(target.clock, every, seconds))
        return staircase_of(target, SHORT)


@pytest.fixture(scope="module")
def punctual():
    return run()


def test_a_punctual_machine_has_no_events_about_time(punctual):
    assert not [event for event in punctual.events if "late" in event.text]
    np.testing.assert_allclose(np.diff(punctual["model"].times), 0.01)
    np.testing.assert_allclose(np.diff(punctual["codes"].times), 0.02, atol=1e-9)


def test_delays_are_noted_and_do_not_look_like_a_bad_hand(punctual):
    late = run(every=37, seconds=0.13)
    assert len([event for event in late.events if " s late" in event.text]) > 10
    assert np.all(np.diff(late["model"].times) > 0)
    expected = staircase_metrics(punctual)
    for channel, row in staircase_metrics(late).items():
        assert row["tracking_rms"] == pytest.approx(expected[channel]["tracking_rms"], rel=0.35), channel


def test_late_answers_do_not_look_like_a_bad_hand(punctual):
    """A command goes out after its reading, so an answer that is late makes the command late too."""
    with guarded(link=BusyHost) as target:
        target.begin(stops=Channel)
        target.wire._transport.late = 0.05
        late = staircase_metrics(staircase_of(target, SHORT))
    expected = staircase_metrics(punctual)
    for finger in FINGERS:
        assert late[finger]["matched_steps"] == expected[finger]["matched_steps"] == 4
        assert late[finger]["tracking_rms"] == pytest.approx(expected[finger]["tracking_rms"], rel=0.35)
