"""Ramps of the guard, at the published speed at most."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from aero.protocol import MAX_CODE
from aero.safety import Thresholds
from aero.safety.opening import STEP_S, move_slowly


class StepClock:
    """Clock that is late by nothing."""

    t = 0.0

    def now(self):
        return self.t

    def sleep_until(self, t):
        self.t = max(self.t, t)


poses = st.lists(st.integers(0, MAX_CODE), min_size=7, max_size=7)


@given(start=poses, goal=poses)
def test_no_step_of_a_ramp_is_faster_than_a_whole_window_in_the_opening_time(start, goal):
    """A short way of 2.3 periods was driven in two: 15 % too fast."""
    sent = [np.array(start)]
    move_slowly(sent.append, StepClock(), start, goal, Thresholds().opening_s)
    assert (sent[-1] == goal).all()
    assert np.abs(np.diff(sent, axis=0)).max() <= MAX_CODE * STEP_S / Thresholds().opening_s + 1
