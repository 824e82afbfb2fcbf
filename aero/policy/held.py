"""Whether the shipped policy still holds its cube, by what the base of the thumb draws.

With a cube, the current of CMC flexion swings with each stroke; an empty hand draws evenly. Measured with `steady` on
firmware 0.2.0, plausible:860000 to 860013, typical and no correction, over windows of `WINDOW_S`: its standard
deviation is below 0.44 A in 95 % of the windows of empty hands (largest 0.49) and above 0.53 A in 98 % of those with
any cube (smallest 0.40).
"""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel

WINDOW_S = 2.0
EMPTY_A, HELD_A = 0.44, 0.53
"""Standard deviation below which the hand is taken for empty, and above which for holding something, A."""


class Held(Enum):
    """What the currents tell at the end of a run."""

    YES = "something is in the hand"
    NO = "nothing is in the hand"
    UNKNOWN = "not known"


def held_at_the_end(currents_a: NDArray[np.float64], period_s: float) -> Held:
    """Return what the last currents (periods, 7), command order, tell; not known where they are too few."""
    needed = round(WINDOW_S / period_s)
    if len(currents_a) < needed:
        return Held.UNKNOWN
    swing_a = float(np.std(np.abs(currents_a[-needed:, Channel.THUMB_CMC_FLEXION])))
    return Held.NO if swing_a < EMPTY_A else Held.YES if swing_a > HELD_A else Held.UNKNOWN
