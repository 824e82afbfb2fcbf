"""Detection of a held cube by the current of CMC flexion, for the shipped policy.

With a cube, the current of CMC flexion oscillates with each stroke; in an empty hand it is steadier. Measured with
`steady` and measured cables on firmware 0.2.0, plausible:860000 to 860023, over windows of `WINDOW_S`
(`python -m train.held_currents`): 0 of 168 windows of empty hands exceed `HELD_A` (largest 0.73 A), 94 % of 168 windows
with a cube do. On plausible:870000 to 870023 none (largest 0.74 A) and 80 % do. A loosely held cube oscillates as
little as an empty hand, so a small standard deviation shows nothing.
"""

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel

WINDOW_S = 2.0
HELD_A = 0.8
"""Threshold of the current's standard deviation, A; above it an object is in the hand. Source: the windows above."""


class Held(Enum):
    """Verdict of the currents at the end of a run."""

    YES = "something is in the hand"
    UNKNOWN = "not known: an empty hand and one that holds lightly draw equal currents"


def held_at_the_end(currents_a: NDArray[np.float64], period_s: float) -> Held:
    """Return the verdict of currents (periods, 7), command order, on the last `WINDOW_S`; UNKNOWN for fewer periods."""
    needed = round(WINDOW_S / period_s)
    if len(currents_a) < needed:
        return Held.UNKNOWN
    swing_a = float(np.std(np.abs(currents_a[-needed:, Channel.THUMB_CMC_FLEXION])))
    return Held.YES if swing_a > HELD_A else Held.UNKNOWN
