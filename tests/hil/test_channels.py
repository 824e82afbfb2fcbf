"""Each command moves its own channel, in the direction the mechanism asks for, and no other."""

import numpy as np
import pytest

from aero.channels import Channel

pytestmark = pytest.mark.moves

FOLLOWS = 0.06 * 65535
"""Static error allowed, codes: 40 of 1183 counts on CMC flexion of one physical hand, and room for another hand."""
STAYS = 0.03 * 65535
QUARTER = 16384


@pytest.mark.parametrize("channel", Channel, ids=lambda channel: channel.label)
def test_a_quarter_closes_one_channel_and_opens_it_again(hand, settle, open_codes, channel):
    before = settle(open_codes)
    codes = open_codes.copy()
    codes[channel] = QUARTER
    closed = settle(codes)
    assert closed[channel] == pytest.approx(QUARTER, abs=FOLLOWS)
    others = np.arange(7) != channel
    np.testing.assert_allclose(closed[others], before[others], atol=STAYS)
    assert settle(open_codes)[channel] == pytest.approx(before[channel], abs=STAYS)


def test_half_closed_hand_holds_where_it_was_sent(hand, settle, open_codes):
    goal = open_codes + 20000
    goal[Channel.THUMB_ABDUCTION] = 40000
    np.testing.assert_allclose(settle(goal), goal, atol=FOLLOWS)


def test_repeating_a_command_moves_nothing(hand, settle, open_codes):
    goal = open_codes + 15000
    first = settle(goal)
    np.testing.assert_allclose(settle(goal), first, atol=0.005 * 65535)


def test_a_closed_finger_pulls_and_an_open_one_rests(hand, settle, open_codes):
    at_rest = np.abs(hand.read_currents())
    goal = open_codes.copy()
    goal[Channel.RING] = 45000
    settle(goal)
    assert abs(hand.read_currents()[Channel.RING]) > at_rest[Channel.RING] + 0.1
