"""Training's built hands are corrected before a policy meets them, as a hand is before it runs one.

The loop on a hand commands every cable longer or shorter by what its joints lack at the nominal grasp
(`model.units.cable_correction`). Here the same is found for a whole batch at once, in the physics of training.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.channels import CABLES, Channel, Joint
from aero.policy.settings import Settings
from model.parameters import BuiltHandParameters
from train.built import BuiltSimulator, build_scene
from train.hands import TIMESTEP_S
from train.simulator import positions
from train.task.episode import PHYSICS_STEP_S
from train.task.grasp import PAPER_RESET, draw_starts
from train.task.signals import unpack

Floats = NDArray[np.float64]

ROUNDS = 4
"""Corrections of a correction."""
SETTLE_S = 0.8
"""How long a hand takes to a posture, from one nearby."""
OUT_OF_REACH_M = (1.0, 0.0, 0.0)
"""Where the cube is meanwhile."""
IDEAL = BuiltHandParameters(
    spool_friction=(0.0,) * len(Channel),
    joint_friction=(0.0,) * len(Joint),
    cable_compliance=0.0,
    stop_compliance=0.0,
    gravity=0.0,
    timestep=TIMESTEP_S,
)
"""The hand that the actuation map describes (unit `ideal`)."""


def corrections(
    models: Sequence[mujoco.MjModel],
    settings: Settings,
    rng: np.random.Generator,
    *,
    error_m: float = 0.0,
    threads: int | None = None,
) -> Floats:
    """Return by how much longer each channel of each hand must be commanded, (hands, 7), m, abduction rad.

    Args:
        models: from `train.built.draw_scenes`.
        settings: whose nominal grasp the joints are to reach.
        rng: for the errors.
        error_m: by how much the correction of a cable may be wrong, uniform on both sides.
        threads: of the simulator (default: all cores).
    """
    codec, nominal = ActuationMap(), np.array(settings.nominal)
    wanted, there = _settled([build_scene(IDEAL, settings.torque_limit)], nominal[None], threads)
    total = np.zeros((len(models), len(Channel)))
    for _ in range(ROUNDS):
        joints, lengths = _settled(models, nominal + total, threads)
        lacking = joints - wanted
        lacking[:, Joint.THUMB_ABDUCTION] = 0.0  # its shaft is the joint itself
        # From where the shafts are, not from where they were sent: servos and friction leave an error of their own.
        total[:, CABLES] = (lengths - there + codec.travel_from_joints(lacking))[:, CABLES]
    total[:, CABLES] += rng.uniform(-error_m, error_m, (len(models), len(CABLES)))
    return total


def _settled(models: Sequence[mujoco.MjModel], lengths: Floats, threads: int | None) -> tuple[Floats, Floats]:
    """Return the joint angles, (hands, 16), and the read lengths, (hands, 7), of hands that were sent to `lengths`."""
    starts = draw_starts(np.random.default_rng(0), len(models), PAPER_RESET)
    starts[:, len(Joint) : len(Joint) + 3] = OUT_OF_REACH_M
    controls = np.repeat(lengths[:, None], round(SETTLE_S / PHYSICS_STEP_S), axis=1)
    with BuiltSimulator(models, threads=threads) as batch:
        states, sensors = batch.advance(batch.at(starts), controls)
    return positions(states)[:, : len(Joint)], unpack(sensors[:, -1]).lengths
