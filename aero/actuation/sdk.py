"""Position codes exactly as the vendor's SDK computes them, for comparing with it and with what it recorded.

`aero-open-sdk` 0.1.0.dev1 clamps joints in silence, normalises by typed-in limits that differ from the excursions by up
to 0.037° on the fingers, and truncates; it knows no shifted window. `ActuationMap` rounds, and refuses what is out of
range.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation import stages
from aero.actuation.arrays import finite_numbers
from aero.actuation.coefficients import load_coefficients
from aero.channels import JOINT_BOX_RAD, Channel, Joint
from aero.protocol import MAX_CODE

SDK_LIMITS_DEG = np.array(
    [
        [0.0, 288.1603],
        [0.0, 288.1603],
        [0.0, 288.1603],
        [0.0, 288.1603],
        [0.0, 100.0],
        [0.0, 104.1250],
        [-15.2789, 247.1500],
    ]
)
SDK_LIMITS_DEG.flags.writeable = False
"""Shaft angles that the SDK takes for codes 0 and 65535, (7, 2) float, degrees, command order."""


def sdk_codes_from_joints(joints_deg: ArrayLike) -> NDArray[np.uint16]:
    """Return the codes (..., 7), uint16, that the SDK sends for postures (..., 16) in degrees and the order of `Joint`.

    Degrees in, because the SDK works in them and truncation shows the last bit of a rounding.
    """
    low, high = np.rad2deg(JOINT_BOX_RAD).T
    paper = load_coefficients("paper")
    joints = finite_numbers(joints_deg, len(Joint), "joints")
    travel = stages.travel_from_joints(paper, np.clip(joints, low, high))
    return sdk_codes_from_angles(stages.angles_from_travel(paper, travel))


def sdk_codes_from_angles(angles_deg: ArrayLike) -> NDArray[np.uint16]:
    """Return the codes (..., 7), uint16, that the SDK sends for shaft angles (..., 7) in degrees; clamps as it does."""
    low, high = SDK_LIMITS_DEG.T
    angles = np.clip(finite_numbers(angles_deg, len(Channel), "shaft angles"), low, high)
    codes: NDArray[np.uint16] = ((angles - low) / (high - low) * MAX_CODE).astype(np.uint16)
    return codes
