"""Making policies: the cube task, its randomisation, training on two backends, evaluation. JAX lives here alone.

`train.task`, `train.simulator` and `train.evaluation` need NumPy and MuJoCo only; `train.environment`, `train.ppo` and
`train.training` need the extra `train`.
"""
