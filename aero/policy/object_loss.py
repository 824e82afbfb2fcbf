"""Has the object left the hand? What the base of the thumb draws tells, once it is known what it draws without.

Fingers that turn an object press it against the thumb, whose base, abduction and CMC flexion, holds against them. What
the other motors draw goes with the gait far more than with the object, and from hand to hand all of it differs
(docs/training.md). So the level is each hand's own, and is learned in a rehearsal with the hand empty.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel

Floats = NDArray[np.float64]

_THUMB_BASE = [Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION]


class ObjectLoss:
    """Watches what the base of the thumb draws over a window of periods."""

    def __init__(self, least_a: float, periods: int) -> None:
        """Watch for windows of `periods` in which it draws less than `least_a` (A) on average.

        The first `periods` are left out: a gait takes that long to get going.
        """
        self._least_a = least_a
        self._still_settling = periods
        self._drawn: deque[float] = deque(maxlen=periods)

    def lost(self, currents_a: Floats) -> bool:
        """Take a period's currents, (7,), A, and return whether the object is gone; a missing reading never says so."""
        if self._still_settling:
            self._still_settling -= 1
            return False
        self._drawn.append(drawn(currents_a))
        return len(self._drawn) == self._drawn.maxlen and bool(np.mean(self._drawn) < self._least_a)


def drawn(currents_a: Floats) -> float:
    """Return what the base of the thumb draws of the currents (7,), the sum of two, A; NaN where one is missing."""
    return float(np.sum(np.abs(currents_a[_THUMB_BASE])))
