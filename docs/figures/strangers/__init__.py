"""Faults outside the catalogue: a set that was thought of (`seventh`), and physics drawn at random (`physics`).

Whoever writes rules of a diagnosis does not read the set.
"""

from figures.strangers.physics import drawn_physics
from figures.strangers.seventh import SEVENTH

__all__ = ["SEVENTH", "drawn_physics"]
