"""The driver keeps a hand safe from its user's mistakes, on any hand."""

import numpy as np
import pytest

from aero.channels import Channel

pytestmark = pytest.mark.moves


@pytest.mark.parametrize(
    "codes",
    [[np.nan] * 7, [0.5] * 7, [0] * 6, [-1] * 7, [65536] * 7, [[0] * 7], "1234567"],
    ids=["nan", "fraction", "six", "negative", "too large", "nested", "text"],
)
def test_nonsense_is_refused_before_it_is_sent(target, hand, codes):
    mark = target.wire.mark()
    with pytest.raises(ValueError, match=r"\S"):
        hand.command_codes(codes)
    assert target.wire.since(mark, 0.0) == ()


def test_settings_are_acknowledged(target, hand):
    if target.firmware == "pre":
        pytest.skip("firmware `pre` has no speed and torque settings; run with --hil-firmware=0.1.0 or later")
    hand.set_torque(Channel.RING, 600)
    hand.set_speed(Channel.RING, 30000)
    hand.set_speed(Channel.RING, 32766)
    hand.set_torque(Channel.RING, 1023 if target.firmware in {"0.1.0", "0.1.1"} else 700)


def test_map_there_and_back(target, hand, settle):
    """A posture commanded as simulator lengths comes back as these lengths."""
    half = target.map.angles_from_codes(np.full(7, 24000))
    lengths = target.map.lengths_from_travel(target.map.travel_from_angles(half))
    codes = target.map.codes_from_lengths(lengths)
    reached = target.map.lengths_from_codes(settle(codes))
    np.testing.assert_allclose(reached[:4], lengths[:4], atol=2e-3)
    assert reached[Channel.THUMB_ABDUCTION] == pytest.approx(lengths[Channel.THUMB_ABDUCTION], abs=0.1)
