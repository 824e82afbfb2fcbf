"""A reading and the time that it may stem from. A host that is late knows less about when, and must not guess."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Reading:
    """Positions, (7,) shares of the command window in command order, with the exchange that brought them."""

    asked: float
    """When the request was about to go out, clock s."""
    replied: float
    """When the reply was in the program's hands, clock s."""
    positions: NDArray[np.float64]

    def longest_s(self, earlier: Reading, telemetry_s: float) -> float:
        """Return the most time that can lie between two readings, s, of values up to `telemetry_s` old when sent.

        The earlier one may be as old as its request and the board's cache allow, the later one as fresh as its reply.
        """
        return self.replied - earlier.asked + telemetry_s
