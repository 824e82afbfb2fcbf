import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from aero.policy.limits import ObjectLoss, drawn
from aero.policy.running import RunSettings

sums = st.lists(st.floats(0.0, 10.0), min_size=1, max_size=60)
periods = st.integers(1, 10)
BASE = [Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION]


def currents(total, others=1.0):
    """Return currents of which the base of the thumb draws `total`."""
    values = np.full(7, others)
    values[BASE] = total * np.array([0.25, -0.75])
    return values


def verdicts(totals, least, window):
    loss = ObjectLoss(least, window)
    return [loss.lost(currents(total)) for total in totals]


@given(sums, periods)
def test_it_is_lost_when_a_whole_window_after_the_settling_draws_too_little(totals, window):
    for i, lost in enumerate(verdicts(totals, 5.0, window)):
        seen = totals[window : i + 1][-window:]
        assert lost == (len(seen) == window and np.mean([drawn(currents(total)) for total in seen]) < 5.0)


@given(sums, periods)
def test_a_hand_that_draws_enough_never_loses(totals, window):
    assert not any(verdicts([5.0 + total for total in totals], 4.99, window))


def test_a_missing_reading_never_says_that_it_is_lost():
    assert not any(verdicts([0.0] * 5 + [np.nan] + [0.0] * 3, 5.0, 4))
    assert verdicts([0.0] * 5 + [np.nan] + [0.0] * 4, 5.0, 4)[-1]


@given(st.floats(0.0, 10.0), st.floats(-10.0, 10.0))
def test_only_the_base_of_the_thumb_counts_and_not_the_sign_of_what_it_draws(total, others):
    assert drawn(currents(total, others)) == pytest.approx(total)


def test_a_reading_that_is_missing_elsewhere_does_not_matter():
    assert drawn(currents(2.0, others=np.nan)) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("settings", "message"),
    [({"rehearsal_s": 1.0}, r"4\.0 s or longer"), ({"rehearsal_s": 6.0, "dry": True}, "nothing to rehearse")],
)
def test_a_rehearsal_that_tells_nothing_is_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        RunSettings(**settings)
