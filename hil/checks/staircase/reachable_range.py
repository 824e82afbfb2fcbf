"""Calibrated range of each channel in the simulator, and its reachable part within a hand's window."""

import numpy as np

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.floats import Floats
from simulator.routed import RoutedHand

SWEEP_SETTLE_S = 2.0
"""Time for a simulated actuator to reach the end of its range, s."""
_MARGIN_RAD = 1e-6
"""Margin to the window's ends, rad, against rounding beyond the window."""


def calibrated_range(simulator: RoutedHand) -> Floats:
    """Sweep one actuator after another over its range; return the extremes of its sensor, (7, 2) m and rad.

    Meanwhile the other cables are extended and the thumb is not abducted. The paper anchors a finger's map between such
    lengths.
    """
    extended = simulator.command_range[:, 1].copy()
    extended[Channel.THUMB_ABDUCTION] = simulator.command_range[Channel.THUMB_ABDUCTION, 0]
    extremes = np.empty((len(Channel), 2))
    for channel in Channel:
        reached = []
        for end in simulator.command_range[channel]:
            goal = extended.copy()
            goal[channel] = end
            simulator.reset()
            simulator.command(goal)
            simulator.advance(SWEEP_SETTLE_S)
            reached.append(simulator.lengths()[channel])
        extremes[channel] = sorted(reached)
    extremes[Channel.THUMB_ABDUCTION] = np.maximum(extremes[Channel.THUMB_ABDUCTION], 0.0)
    return extremes


def reachable(codec: ActuationMap, length_range: Floats) -> tuple[Floats, Floats]:
    """Return each channel's open and closed end of the reachable sweep, as simulator lengths.

    The sweep of one channel runs from its open end to its closed end while all others are open. Either end is the
    simulator's own, or the length at which the channel's shaft meets the end of its window, whichever comes first.
    The map is affine, so one line through two points gives that length.

    Args:
        codec: the map of the hand.
        length_range: (7, 2) float, the simulator's shortest and longest lengths, m and rad.

    Returns:
        Open lengths (7,) and closed lengths (7,).

    Raises:
        ValueError: a channel has no reachable range; map and simulator do not belong together.
    """
    shortest, longest = np.asarray(length_range, float).T
    opened, closed = longest.copy(), shortest.copy()
    abduction = Channel.THUMB_ABDUCTION
    opened[abduction], closed[abduction] = shortest[abduction], longest[abduction]
    for channel in Channel:
        open_angle, closed_angle = _angles(codec, opened, closed, channel)
        low, high = codec.window_rad[channel] + (_MARGIN_RAD, -_MARGIN_RAD)
        parts = np.clip((np.array([low, high]) - open_angle) / (closed_angle - open_angle), 0.0, 1.0)
        if not parts[0] < parts[1]:
            raise ValueError(
                f"{channel.label}: the simulator's range maps to {np.rad2deg(open_angle):.1f}.."
                f"{np.rad2deg(closed_angle):.1f} deg of shaft, none of which the window "
                f"{np.rad2deg(low):.1f}..{np.rad2deg(high):.1f} deg allows; does the map belong to this hand?"
            )
        ends = opened[channel] + parts * (closed[channel] - opened[channel])
        opened[channel], closed[channel] = ends
    return opened, closed


def _angles(codec: ActuationMap, opened: Floats, closed: Floats, channel: Channel) -> tuple[float, float]:
    """Return the channel's shaft angle with all channels open, and with only this channel closed, rad."""
    lengths = np.stack([opened, opened])
    lengths[1, channel] = closed[channel]
    angles = codec.angles_from_travel(codec.travel_from_lengths(lengths))[:, channel]
    return float(angles[0]), float(angles[1])
