"""What a guarded hand is doing, and what it says about itself at rest."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Health:
    """What a hand says about itself while nothing moves, arrays (7,) in command order."""

    codes: NDArray[np.uint16]
    currents_a: Floats
    temperatures_c: Floats


class Phase(Enum):
    """Where a guarded hand is."""

    RESTING = "nothing has moved yet"
    OPENING = "it opens and approaches its first goal slowly, with limited speed and torque"
    MOVING = "the program moves it"
    ENDING = "it opens slowly for the last time"
    STOPPED = "it was opened and takes no more commands"
