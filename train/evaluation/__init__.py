"""How good a policy is: rotation, rate, survival, smoothness and cable travel over many episodes. NumPy and MuJoCo."""
