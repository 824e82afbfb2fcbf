"""The driver keeps a hand safe from its user's mistakes, on any hand."""

import numpy as np
import pytest
from policy_bytes import positions_sent
from quantities import assert_near

from aero.channels import Channel

pytestmark = pytest.mark.moves
FITTED = (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
FAR = (1.0, 1.0, 1.0, 1.0, 1.0, 0.6, 0.6)
"""Fraction of each channel's window that it closes alone; the thumb's stops are within its cables' windows."""


@pytest.mark.parametrize(
    "codes",
    [[np.nan] * 7, [0.5] * 7, [0] * 6, [-1] * 7, [65536] * 7, [[0] * 7], "1234567"],
    ids=["nan", "fraction", "six", "negative", "too large", "nested", "text"],
)
def test_nonsense_is_refused_before_it_is_sent(target, hand, codes):
    mark = target.wire.mark()
    with pytest.raises(ValueError, match=r"\S"):
        hand.command_codes(codes)
    sent = target.wire.since(mark, 0.0)
    assert sent == (), f"{len(sent)} frames for refused codes, should be none"


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
    # The thumb's two fits disagree by millimetres away from its workspace.
    off = np.where(np.isin(Channel, FITTED), 0.0, reached - lengths)
    within = np.where(np.arange(7) == Channel.THUMB_ABDUCTION, 0.1, 2e-3)
    assert_near("length reached less length asked", off, 0.0, within, "m (rad)")


@pytest.mark.parametrize(("end", "code"), [("open", 0), ("closed", 65535)])
@pytest.mark.parametrize("beyond", [1e-4, 0.5, 100.0], ids="{:g} rad".format)
def test_a_target_beyond_a_window_is_its_end(target, end, code, beyond):
    """A code that wraps around is a full motion the other way; nothing moves here."""
    low, high = target.map.window_rad.T
    codes, clipped = target.map.saturating_codes(low - beyond if end == "open" else high + beyond)
    assert_near(f"code of a target {beyond:g} rad beyond the {end} end", codes, code, 0)
    assert clipped.all(), f"clipped channels of a target {beyond:g} rad beyond the {end} end: {clipped}, should be all"


def test_the_ends_of_every_window_are_sent_as_they_are(target, hand, settle, open_codes):
    """Both ends of each channel, one after the other, in the bytes; the thumb as far as no other digit is met."""
    for channel in Channel:
        for code in (round(FAR[channel] * 65535), 0):
            mark = target.wire.mark()
            goal = np.where(np.arange(7) == channel, code, open_codes)
            hand.command_codes(goal)
            sent, _ = positions_sent(target.wire.since(mark, 0.0))
            assert_near(f"code sent for {channel.label} at {code}", sent[-1], goal, 0)
            target.clock.sleep_until(target.clock.now() + 0.4)
    assert_near("position of the opened hand", settle(open_codes), 0, 0.06 * 65535)
