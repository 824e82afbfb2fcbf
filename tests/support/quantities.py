"""Assertions of seven readings that name the quantity, the channel and both numbers."""

import numpy as np

from aero.channels import Channel


def assert_between(quantity, found, least, most, unit="codes"):
    """Fail with a sentence for the first channel whose value is outside its bounds, (7,) or one number each."""
    values, least, most = (np.broadcast_to(np.asarray(one, float), (len(Channel),)) for one in (found, least, most))
    for channel in Channel:
        low, here, high = least[channel], values[channel], most[channel]
        assert low <= here <= high, f"{channel.title}: {quantity} {here:.5g} {unit}, should be {low:.5g} to {high:.5g}"


def assert_near(quantity, found, expected, within, unit="codes"):
    """Fail with a sentence for the first channel whose value is off by more than `within`."""
    expected = np.asarray(expected, float)
    assert_between(quantity, found, expected - within, expected + within, unit)
