"""A hand whose host rounds what it reads and writes, as the official ROS 2 node does to whole degrees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.policy.running import PolicyHand
from aero.protocol import MAX_CODE

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CoarseHand:
    """Passes everything on; positions only in multiples of `step_codes`."""

    hand: PolicyHand
    step_codes: Floats
    """Codes that a step of each channel has, (7,)."""

    def read_codes(self) -> NDArray[np.uint16]:
        """Read positions, (7,), command order."""
        return self._rounded(self.hand.read_codes())

    def command_codes(self, codes: ArrayLike) -> None:
        """Send every channel to a position, (7,), command order."""
        self.hand.command_codes(self._rounded(codes))

    def read_currents(self) -> Floats:
        """Read motor currents, (7,), A, command order."""
        return self.hand.read_currents()

    def read_temperatures(self) -> Floats:
        """Read servo temperatures, (7,), °C, command order."""
        return self.hand.read_temperatures()

    def _rounded(self, codes: ArrayLike) -> NDArray[np.uint16]:
        steps = np.round(np.asarray(codes, dtype=float) / self.step_codes)
        return np.clip(np.round(steps * self.step_codes), 0, MAX_CODE).astype(np.uint16)


def step_codes(window_rad: Floats, step_rad: float) -> Floats:
    """Return how many codes a step of the shafts has, (7,), for windows (7, 2)."""
    steps: Floats = MAX_CODE * step_rad / np.abs(np.diff(window_rad, axis=1)[:, 0])
    return steps
