"""What ships is fitted here: policies, units, coefficients of the map. JAX lives here alone.

`train.task`, `train.simulator`, `train.evaluation` and `train.identification` need NumPy and MuJoCo only;
`train.environment`, `train.ppo` and `train.training` need the extra `train`.
"""
