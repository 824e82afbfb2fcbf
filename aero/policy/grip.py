"""Has the object left the hand? What its motors draw tells, once it is known what they draw without the object.

Fingers that press on an object draw more than the same gait in an empty hand, but a hand with stiff springs draws more
when empty than another does when full (docs/training.md). So the level is each hand's own, and is learned in a
rehearsal with the hand empty.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Grip:
    """Watches the sum of the motors' currents over a window of periods."""

    def __init__(self, least_a: float, periods: int) -> None:
        """Watch for windows of `periods` whose mean sum is under `least_a` (A).

        The first `periods` are left out: a gait takes that long to get going.
        """
        self._least_a = least_a
        self._still_settling = periods
        self._sums: deque[float] = deque(maxlen=periods)

    def lost(self, currents_a: Floats) -> bool:
        """Take a period's currents, (7,), A, and return whether the object is gone; a missing reading never says so."""
        if self._still_settling:
            self._still_settling -= 1
            return False
        self._sums.append(drawn(currents_a))
        return len(self._sums) == self._sums.maxlen and bool(np.mean(self._sums) < self._least_a)


def drawn(currents_a: Floats) -> float:
    """Return the sum of the absolute currents (7,), A; NaN where one is missing."""
    return float(np.sum(np.abs(currents_a)))
