"""Checkpoint of a training run, and the evaluation of its policy."""

import numpy as np

from train.evaluation.rollouts import Episodes
from train.run_state import Checkpoint

POINT = Checkpoint(
    attempt=0,
    steps=204_800,
    elapsed_s=31.5,
    steps_per_s=6500.0,
    rotation_rad=8.3,
    rate_rad_s=0.55,
    survival=0.97,
    airborne=0.001,
    score=0.5,
    average_rate_rad_s=0.5,
    average_survival=0.98,
    training_rate_rad_s=0.45,
    hazard_per_s=0.002,
    drop_price=120.0,
    rate_error_rad_s=0.05,
)

EPISODES = Episodes(
    kept=np.array([True, False]),
    alive_s=np.array([10.0, 5.0]),
    rotation_rad=np.array([10.0, 10.0]),
    airborne=np.array([0.0, 0.3]),
    travel_per_s=np.full((2, 7), 0.01),
)
"""Results of two episodes; in the second the cube bounces and is lost."""
