import numpy as np
import pytest
from figures.p_damping import FREE, START, PDampingModel
from hypothesis import given, settings
from hypothesis import strategies as st

from train.identification.trace import Trace, window_counts

SPANS = window_counts("right")


def trace(codes, t_read):
    m = len(t_read)
    blank = np.zeros((m, 7))
    t_command = 0.5 * np.arange(len(codes))
    return Trace("made", t_command, np.array(codes), np.array(t_read), blank, blank, blank, SPANS)


def predicted(one):
    return PDampingModel((one,)).residuals([np.zeros(len(FREE))], (0.0,))[0]


def test_every_number_has_a_start():
    assert len(START) == len(FREE)


@given(st.lists(st.lists(st.integers(0, 65535), min_size=7, max_size=7), min_size=2, max_size=3))
@settings(max_examples=10, deadline=None)
def test_predictions_stay_in_the_window_and_end_near_the_command(codes):
    counts = predicted(trace(codes, [0.0, 0.5 * len(codes), 0.5 * len(codes) + 1.0]))
    assert np.all((counts >= 0.0) & (counts <= SPANS))
    goal = np.array(codes[-1]) * SPANS / 65535
    assert np.all(np.abs(counts[-1] - goal) <= 36.0)


def test_a_step_takes_the_time_of_the_recorded_hand():
    """60-70 % of a small step is done at 56 ms and 86-93 % at 88 ms (real hand, 30-260 counts)."""
    start, step = 20_000, 4_000
    counts = predicted(trace([[start] * 7, [start + step] * 7], [0.49, 0.556, 0.588]))
    done = ((counts - counts[0]) / (step * SPANS / 65535))[:, :4]
    assert done[1] == pytest.approx(0.65, abs=0.09)
    assert done[2] == pytest.approx(0.88, abs=0.09)
