"""Recordings for Foxglove: joint states, the hand in 3D and findings, in the schemas that its panels understand."""
