"""Calibration: fit a unit to recordings of a physical hand, and say how well it predicts them."""
