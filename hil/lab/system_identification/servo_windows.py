"""Command windows and current signs of the two hands, in command order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_emulator.firmware.hands import HANDS, SHAFT_OF_SERVO, HandSide


def _by_channel(values: NDArray[np.float64]) -> NDArray[np.float64]:
    ordered = np.empty(len(SHAFT_OF_SERVO))
    ordered[list(SHAFT_OF_SERVO)] = values
    return ordered


def window_counts(side: HandSide) -> NDArray[np.float64]:
    """Return the width of each channel's command window, (7,) servo counts."""
    hand = HANDS[side]
    return _by_channel(np.abs(np.subtract(hand.grasp, hand.extend, dtype=float)))


def closing_current_sign(side: HandSide) -> NDArray[np.float64]:
    """Return the sign, (7,) +1 or -1, that a current register shows while its channel pulls closed.

    Registers are positive toward lower counts (one physical hand, public logs June-July 2026,
    TTdragoAlex/tetherIA-aero-hand-open 58b518e).
    """
    hand = HANDS[side]
    return _by_channel(np.sign(np.subtract(hand.extend, hand.grasp, dtype=float)))
