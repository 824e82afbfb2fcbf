"""Production of the shipped files: policies, units, limits, map coefficients. The only package with JAX.

Only `train.trainer`, `train.selection` and what they import of JAX need the extra `train`.
"""
