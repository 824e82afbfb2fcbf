"""How far the simulator's channels go from the open hand to a fist, under the commands that the hand gets."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.channels import FINGERS, Channel
from aero.protocol import MAX_CODE
from model import RoutedHand
from model.geometry import Side

FIST = np.zeros((2, len(Channel)), np.uint16)
"""Codes of a fist, (2, 7): the fingers first, then the thumb over them. Closed at once, the thumb is in the palm before
a slow finger, which then stops at it and not at its own end."""
FIST[0, list(FINGERS)] = MAX_CODE
FIST[1] = MAX_CODE
SETTLE_S = 2.0
"""Time in which the simulator comes to rest, s."""


@cache
def simulated_fist(firmware: str, window: str, side: Side) -> NDArray[np.float64]:
    """Return what the simulator's sensors read in the fist less open, (7,) float, m and rad, positive closes.

    It gets the lengths that the map for this firmware, window and side makes of the codes, cut to what its actuators
    take.
    """
    codec, simulator = ActuationMap.for_firmware(firmware, window, hand=side), RoutedHand(side)
    stages = codec.lengths_from_codes(np.vstack([np.zeros((1, len(Channel)), np.uint16), FIST]))
    reached = []
    for lengths in np.clip(stages, *simulator.command_range.T):
        simulator.command(lengths)
        simulator.advance(SETTLE_S)
        reached.append(simulator.lengths())
    closing = np.where(np.arange(len(Channel)) == Channel.THUMB_ABDUCTION, 1.0, -1.0)
    return closing * (reached[-1] - reached[0])
