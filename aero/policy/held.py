"""Whether the shipped policy still holds its cube, by what the base of the thumb draws.

With a cube, the current of CMC flexion swings with each stroke; an empty hand draws evenly. Measured with `steady` and
the typical correction on firmware 0.2.0, plausible:860000 to 860013 and 870000 to 870007, over windows of `WINDOW_S`:
none of 264 windows of empty hands swings by `HELD_A` (largest 0.56 A), 85 % of 249 with any cube do. A cube that is
held lightly swings as little as none, so a small swing tells nothing.
"""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel

WINDOW_S = 2.0
HELD_A = 0.6
"""Standard deviation from which on something is in the hand, A."""


class Held(Enum):
    """What the currents tell at the end of a run."""

    YES = "something is in the hand"
    UNKNOWN = "not known: an empty hand and one that holds lightly draw alike"


def held_at_the_end(currents_a: NDArray[np.float64], period_s: float) -> Held:
    """Return what the last currents (periods, 7), command order, tell; not known where they are too few."""
    needed = round(WINDOW_S / period_s)
    if len(currents_a) < needed:
        return Held.UNKNOWN
    swing_a = float(np.std(np.abs(currents_a[-needed:, Channel.THUMB_CMC_FLEXION])))
    return Held.YES if swing_a > HELD_A else Held.UNKNOWN
