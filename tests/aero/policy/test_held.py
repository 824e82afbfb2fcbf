import numpy as np
import pytest

from aero.channels import Channel
from aero.policy.held import HELD_A, Held, held_at_the_end


def drawn(swing_a, periods=40):
    currents = np.ones((periods, 7))
    currents[::2, Channel.THUMB_CMC_FLEXION] += 2 * swing_a
    return currents


@pytest.mark.parametrize(
    ("currents", "held"),
    [
        (drawn(HELD_A - 0.01), Held.UNKNOWN),
        (drawn(HELD_A + 0.01), Held.YES),
        (-drawn(HELD_A + 0.01), Held.YES),
        (drawn(HELD_A + 0.01, 39), Held.UNKNOWN),
        (np.zeros((0, 7)), Held.UNKNOWN),
        (np.vstack([drawn(2.0), drawn(0.0)]), Held.UNKNOWN),
        (np.full((40, 7), np.nan), Held.UNKNOWN),
    ],
)
def test_the_last_two_seconds_of_the_thumbs_base_decide(currents, held):
    assert held_at_the_end(currents, 0.05) is held
