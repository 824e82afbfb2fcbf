"""Slack and stops of cables in a record of the measuring motion, and the corrections that follow."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import CABLES, FINGERS, Channel
from aero.policy.cables import (
    MEASURING_S,
    PERIOD_S,
    SLOW_M,
    SURE_M,
    Samples,
    Seen,
    Travels,
    corners,
    estimated,
    lines,
    observed,
)
from aero.policy.running import typical_correction

STROKE_M = np.array([0.0453, 0.0453, 0.0453, 0.0453, 1.745, 0.0164, 0.0412])
FRICTION_M, LOADED_M = 1e-4, 2e-4
COUNT_M = 13.8e-6


def recorded(slack_m, stop_m, *, to_stops=True):
    """Return the record of a hand whose cables are taut from `slack_m` on and whose digits stand at `stop_m`."""
    spans, rows = corners(STROKE_M, to_stops=to_stops)
    times = PERIOD_S * np.arange(1, round(spans[-1] / PERIOD_S) + 1)
    wanted = np.stack([np.interp(times, spans, row) for row in rows.T], axis=1)
    followed = np.maximum(wanted - FRICTION_M, 0.0)
    travel = np.where(followed > slack_m, np.maximum(followed - LOADED_M, slack_m), followed)
    travel = np.round(np.minimum(travel, stop_m) / COUNT_M) * COUNT_M
    return Samples(times, wanted, travel, np.zeros_like(wanted))


def of_fingers(samples):
    return [observed(samples)[finger] for finger in FINGERS]


@given(st.floats(0.5e-3, 5e-3))
def test_a_long_cable_shows_its_slack(slack_m):
    for seen in of_fingers(recorded(slack_m, np.inf)):
        assert seen.slack == pytest.approx(slack_m, abs=1.5e-4)
        assert np.isinf(seen.stop)


@given(st.floats(0.035, 0.0442))
def test_a_short_cable_shows_its_stop(stop_m):
    for seen in of_fingers(recorded(-1.0, stop_m)):
        assert np.isnan(seen.slack)
        assert seen.stop == pytest.approx(stop_m, abs=2 * COUNT_M)


def test_a_hand_without_torque_limits_is_not_driven_into_its_stops():
    samples = recorded(-1.0, np.inf, to_stops=False)
    assert (samples.wanted.max(axis=0) < 0.4 * STROKE_M).all()
    cables = estimated(observed(samples))
    assert {cable.seen for cable in cables.values()} == {Seen.NOTHING}
    assert not any(cable.sure for cable in cables.values())
    assert [cables[one].correction for one in CABLES] == [typical_correction()[one] for one in CABLES]


def test_the_motion_lasts_as_long_as_it_says_and_presses_no_digit_into_another_or_the_palm():
    times, travels = corners(STROKE_M, to_stops=True)
    assert times[-1] == pytest.approx(MEASURING_S, abs=0.01)
    fingers, base, tip = travels[:, :4].max(axis=1), *travels[:, 5:].T
    closed = np.stack([fingers > SLOW_M, base > SLOW_M, tip > SLOW_M])
    assert closed.any(axis=1).all()
    assert (closed.sum(axis=0) <= 1).all()
    assert (travels[closed[2], Channel.THUMB_ABDUCTION] == STROKE_M[Channel.THUMB_ABDUCTION]).all()
    assert not travels[-1].any()


travels = st.one_of(st.just(np.nan), st.floats(0.0, 0.05))


@given(st.lists(st.builds(Travels, travels, st.one_of(travels, st.just(np.inf))), min_size=6, max_size=6))
def test_every_cable_has_a_finite_correction_and_names_its_source(rows):
    seen = dict(zip(CABLES, rows, strict=True))
    for channel, cable in estimated(seen).items():
        assert np.isfinite([cable.correction, cable.within]).all()
        assert cable.sure == (cable.within <= SURE_M)
        if cable.seen is Seen.SLACK:
            assert np.isfinite(seen[channel].slack)


def test_a_longer_cable_needs_more_winding():
    assert all(line.own < 0.0 for (_, kind), line in lines().items() if kind in (Seen.SLACK, Seen.STOP))
    assert Channel.THUMB_ABDUCTION not in {channel for channel, _ in lines()}
