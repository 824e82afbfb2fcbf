"""Faults outside the catalogue: physics drawn at random, and five that a run is known to find hard."""

from figures.strangers.five import FIVE
from figures.strangers.physics import drawn_physics

__all__ = ["FIVE", "drawn_physics"]
