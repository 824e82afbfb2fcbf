"""A posture that several experiments close to."""

LOOSE_GRASP = (0.5, 0.5, 0.5, 0.5, 0.5, 0.3, 0.4)
"""Parts of each channel's window: half closed, and no digit meets another."""
