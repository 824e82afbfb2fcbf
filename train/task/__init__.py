"""The cube task as pure functions over NumPy or JAX arrays: signals, critic state, reward, reset.

What deployment shares with training (observation, action, which action is shown) is in `aero.policy.task`.
"""
