"""Time for which a grip can be held, against the maker's table."""

import numpy as np
import pytest

from aero.channels import Channel
from aero.safety.heat import HeatWatch

CURRENT_A_PER_UNIT = 0.0065
"""Nominal current of a torque unit."""


@pytest.mark.parametrize(("torque", "least_s", "most_s"), [(1000, 15, 30), (700, 120, 180), (600, 300, 420)])
def test_a_grip_reaches_80_degrees_when_the_maker_says_so(torque, least_s, most_s):
    heat, currents = HeatWatch(65.0), np.zeros(7)
    currents[Channel.RING] = torque * CURRENT_A_PER_UNIT
    heat.drawn(0.0, currents)
    heat.felt(np.full(7, 35.0))
    grip = heat.grip()
    assert grip.channel is Channel.RING
    assert least_s <= grip.cut_s <= most_s
    assert grip.limit_s < grip.cut_s
    assert f"80 °C in about {grip.cut_s:.0f} s" in str(grip)


def test_a_light_grip_is_held_for_an_hour():
    heat = HeatWatch(65.0)
    assert heat.grip() is None
    heat.drawn(0.0, np.full(7, 1.0))
    heat.felt(np.full(7, 35.0))
    assert "for an hour or longer" in str(heat.grip())
