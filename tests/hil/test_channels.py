"""Each command moves its own channel, in the direction the mechanism asks for, and no other."""

import numpy as np
import pytest
from quantities import assert_near

from aero.channels import Channel

pytestmark = pytest.mark.moves

FOLLOWS = 0.06 * 65535
"""Static error allowed, codes: 40 of 1183 counts on CMC flexion of one physical hand, and room for another hand."""
STAYS = 0.03 * 65535
QUARTER = 16384
STROKE_S = 1.5
"""Time in which a channel closes by half, s."""


@pytest.mark.parametrize("channel", Channel, ids=lambda channel: channel.label)
def test_a_quarter_closes_one_channel_and_opens_it_again(hand, settle, open_codes, channel):
    before = settle(open_codes)
    codes = open_codes.copy()
    codes[channel] = QUARTER
    closed = settle(codes)
    others = np.arange(7) != channel
    assert_near(
        f"position with {channel.label} a quarter closed",
        closed,
        np.where(others, before, QUARTER),
        np.where(others, STAYS, FOLLOWS),
    )
    again = np.where(others, before, settle(open_codes))
    assert_near("position when opened again", again, before, STAYS)


def test_half_closed_hand_holds_where_it_was_sent(hand, settle, open_codes):
    goal = open_codes + 20000
    goal[Channel.THUMB_ABDUCTION] = 40000
    assert_near("position of the half closed hand", settle(goal), goal, FOLLOWS)


def test_repeating_a_command_moves_nothing(hand, settle, open_codes):
    goal = open_codes + 15000
    first = settle(goal)
    assert_near("position after a repeated command", settle(goal), first, 0.005 * 65535)


def test_a_closed_finger_pulls_and_an_open_one_rests(hand, settle, open_codes):
    at_rest = np.abs(hand.read_currents())
    goal = open_codes.copy()
    goal[Channel.RING] = 45000
    settle(goal)
    pull = abs(hand.read_currents()[Channel.RING]) - at_rest[Channel.RING]
    assert pull > 0.1, f"current of the closed ring finger {pull:.3f} A more than at rest, should be more than 0.1 A"


@pytest.mark.parametrize("channel", Channel, ids=lambda channel: channel.label)
def test_the_speeds_read_make_up_the_motion_read(target, hand, settle, open_codes, channel):
    """Their integral over a stroke is the angle between its positions; the sign is the register's."""
    begin = target.map.angles_from_codes(settle(open_codes))
    goal = open_codes.copy()
    goal[channel] = 2 * QUARTER
    hand.command_codes(goal)
    times, speeds = [], []
    until = target.clock.now() + STROKE_S
    while target.clock.now() < until:
        times.append(target.clock.now())
        speeds.append(hand.read_speeds())
        target.clock.sleep_until(target.clock.now() + 0.01)
    turned = np.abs(np.trapezoid(np.array(speeds), np.array(times), axis=0))
    moved = np.abs(target.map.angles_from_codes(hand.read_codes()) - begin)
    assert_near("angle from the speeds read", turned, moved, 0.1 + 0.1 * moved, "rad")
