"""Angles as LeRobot's data sets hold them, and the codes of one hand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation import ActuationMap
from aero.channels import Channel

POSITIONS = tuple(f"{channel.label}.pos" for channel in Channel)
"""Names of the seven angles, command order."""
CURRENTS = tuple(f"{channel.label}.current" for channel in Channel)
"""Names of the seven motor currents, command order."""


def codes_from_degrees(codec: ActuationMap, degrees: ArrayLike) -> NDArray[np.uint16]:
    """Return the codes (7,) of angles (7,), degrees; an angle beyond the command window becomes the window's end.

    The angles are the compact posture: one angle for all joints on a cable, 0 for the extended hand.

    Raises:
        ValueError: not seven finite numbers.
    """
    compact = np.deg2rad(np.asarray(degrees, np.float64))
    travel = codec.travel_from_joints(codec.joints_from_compact(compact))
    codes: NDArray[np.uint16] = codec.saturating_codes(codec.angles_from_travel(travel)).codes
    return codes


def degrees_from_codes(codec: ActuationMap, codes: ArrayLike) -> NDArray[np.float64]:
    """Return the angles (..., 7), degrees, of codes (..., 7)."""
    degrees: NDArray[np.float64] = np.rad2deg(codec.compact_from_codes(np.asarray(codes)))
    return degrees


def named(degrees: ArrayLike) -> dict[str, float]:
    """Return angles (7,), degrees, under their names."""
    return dict(zip(POSITIONS, np.asarray(degrees, np.float64).tolist(), strict=True))


def listed(action: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return the angles (7,), degrees, of an action, whose values are numbers or tensors of one.

    Raises:
        ValueError: an angle is missing; the message says which.
    """
    missing = [name for name in POSITIONS if name not in action]
    if missing:
        raise ValueError(f"an action needs all seven angles; missing: {', '.join(missing)}")
    return np.array([float(action[name]) for name in POSITIONS])
