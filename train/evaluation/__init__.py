"""Evaluation of a policy: rotation, rate, survival, smoothness and cable travel. NumPy and MuJoCo."""
