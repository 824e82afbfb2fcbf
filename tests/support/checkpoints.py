"""A checkpoint as a training run writes it."""

from train.progress import Checkpoint

POINT = Checkpoint(
    attempt=0,
    steps=204_800,
    elapsed_s=31.5,
    steps_per_s=6500.0,
    rotation_rad=8.3,
    rate_rad_s=0.55,
    survival=0.97,
    airborne=0.001,
    overspeed=0.0,
    score=0.5,
)
