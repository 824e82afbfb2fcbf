"""Production of what ships: policies, units, limits and map coefficients. The only package that uses JAX.

Only `train.trainer`, `train.selection` and what they import of JAX need the extra `train`.
"""
