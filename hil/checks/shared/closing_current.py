"""What the mechanism alone says about signs; no map, no window and no measurement goes in here.

Every servo of a right hand but the flexor's closes its channel by turning towards lower counts, and a left hand is
mirrored. A positive current pulls towards lower counts. Source: mounting of the servos (`aero-open-firmware` d7bd82e)
and the public logs of June-July 2026 (TTdragoAlex/tetherIA-aero-hand-open 58b518e).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel

Floats = NDArray[np.float64]


def closing_current(currents: Floats, side: Literal["right", "left"]) -> Floats:
    """Return currents with the sign of what they do to the hand: positive pulls the channel closed.

    Args:
        currents: (..., 7) as read, A.
        side: `right` or `left`.
    """
    signs = np.ones(len(Channel))
    signs[Channel.THUMB_FLEXOR] = -1.0
    return currents * (signs if side == "right" else -signs)
