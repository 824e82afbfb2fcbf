"""Policies on a hand: one run, one trial with the cube, and where a gap to the simulator comes from."""
