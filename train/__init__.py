"""What ships is made here, from many runs: policies, units, limits, coefficients of the map. JAX lives here alone.

Only `train.trainer`, `train.selection` and what they import of JAX need the extra `train`.
"""
