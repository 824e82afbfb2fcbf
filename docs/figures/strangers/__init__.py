"""Faults outside the catalogue: physics drawn at random."""

from figures.strangers.physics import drawn_physics

__all__ = ["drawn_physics"]
