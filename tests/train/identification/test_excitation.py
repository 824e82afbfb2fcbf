import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import FINGERS, THUMB, Channel
from train.identification.excitation import MOTIONS, PERIOD_S, REACH, excitation

NAMES = [*MOTIONS, "all"]
REACHES = np.array([REACH[channel] for channel in Channel])


@given(st.sampled_from(NAMES), st.floats(0.05, 1.0), st.lists(st.sampled_from(list(Channel)), min_size=1, unique=True))
def test_moves_fingers_together_or_one_thumb_channel_within_reach_and_ends_open(name, scale, channels):
    fractions = excitation(name, scale=scale, channels=tuple(channels)).fractions
    assert np.all(fractions >= 0.0)
    assert np.all(fractions <= scale * REACHES + 1e-12)
    moving = fractions > 0.0
    assert np.all(moving[:, THUMB].sum(axis=1) + moving[:, FINGERS].any(axis=1) <= 1)
    shares = (fractions / REACHES)[:, [channel for channel in FINGERS if channel in channels]]
    assert np.allclose(shares, shares[:, :1])
    assert not fractions[0].any()
    assert not fractions[-1].any()
    moved = np.flatnonzero(fractions.any(axis=0))
    assert set(moved.tolist()) == {int(channel) for channel in channels}


def test_all_of_it_takes_less_than_five_minutes():
    assert excitation("all").duration_s < 300.0


def test_readings_of_every_age_come_by():
    """The board renews what it answers every 10 ms; a period that is a multiple of it would meet one age only."""
    ages_s = np.arange(20) * PERIOD_S % 0.010
    assert np.diff(np.sort([*ages_s, 0.010])).max() < 0.0015


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"name": "jumps"}, "steps, ramps, chirps and all"),
        ({"name": "steps", "scale": 0.0}, "not 0.0"),
        ({"name": "steps", "scale": 1.1}, "not 1.1"),
        ({"name": "steps", "channels": ()}, "at least one channel"),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(ValueError, match=message):
        excitation(**arguments)
