"""The simulator as the experiments see it; `model.RoutedHand` is one."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MODEL_STEP_S = 0.01
"""Time step of the routed hand, and of its trace."""


class SimulatedHand(Protocol):
    """The routed hand as the experiments see it; lengths are (7,) in command order, m and rad."""

    @property
    def command_range(self) -> Floats:
        """Admissible commands, (7, 2)."""
        ...

    def reset(self) -> None:
        """Return to the open hand at rest."""
        ...

    def command(self, lengths: Floats) -> None:
        """Set the goal lengths."""
        ...

    def advance(self, seconds: float) -> None:
        """Move time forward."""
        ...

    def lengths(self) -> Floats:
        """Return the sensor lengths."""
        ...
