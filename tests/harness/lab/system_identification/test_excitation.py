import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from hil.lab.system_identification.excitation import MOTIONS, REACH, excitation

NAMES = [*MOTIONS, "all"]
REACHES = np.array([REACH[channel] for channel in Channel])


@given(st.sampled_from(NAMES), st.floats(0.05, 1.0), st.lists(st.sampled_from(list(Channel)), min_size=1, unique=True))
def test_moves_one_channel_at_a_time_within_reach_and_ends_open(name, scale, channels):
    fractions = excitation(name, scale=scale, channels=tuple(channels)).fractions
    assert np.all(fractions >= 0.0)
    assert np.all(fractions <= scale * REACHES + 1e-12)
    assert np.all(np.count_nonzero(fractions, axis=1) <= 1)
    assert not fractions[0].any()
    assert not fractions[-1].any()
    moved = np.flatnonzero(fractions.any(axis=0))
    assert set(moved.tolist()) == {int(channel) for channel in channels}


@pytest.mark.parametrize("name", NAMES)
def test_grows_with_its_scale(name):
    small, large = (excitation(name, scale=scale).fractions for scale in (0.25, 1.0))
    assert np.allclose(4.0 * small, large)


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
