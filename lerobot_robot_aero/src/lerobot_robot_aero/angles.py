"""Conversion between the angles in LeRobot's data sets and the command codes of a hand."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.policy.settings import PAPER_DEPLOYMENT
from model.units.cable_correction import named_correction

POSITIONS = tuple(f"{channel.label}.pos" for channel in Channel)
"""Names of the seven angles, command order."""
CURRENTS = tuple(f"{channel.label}.current" for channel in Channel)
"""Names of the seven motor currents, command order."""
NO_SLACK = (0.0,) * len(Channel)


@dataclass(frozen=True)
class AngleMap:
    """Conversion between angles and the codes of one hand.

    Angles are degrees of the compact posture: one angle for all joints on a cable, 0 for the extended hand.
    """

    codec: ActuationMap
    """Actuation map for the hand's firmware and side."""
    slack: tuple[float, ...] = NO_SLACK
    """Slack of each cable, added to the travel of the map, (7,), m (abduction: rad)."""

    @classmethod
    def corrected(cls, codec: ActuationMap, whose: str) -> Self:
        """Return the map with a cable correction: `typical`, `none`, or that of a unit.

        The slack is computed at the paper's nominal grasp, as by `aero-hil run-policy --correction`.

        Raises:
            ValueError: the unit is unknown.
        """
        nominal = np.array(PAPER_DEPLOYMENT.nominal)
        longer = nominal + named_correction(whose, PAPER_DEPLOYMENT)
        return cls(codec, tuple((codec.travel_from_lengths(longer) - codec.travel_from_lengths(nominal)).tolist()))

    def codes(self, degrees: ArrayLike) -> NDArray[np.uint16]:
        """Return the codes (7,) of angles (7,), degrees, clipped to the command window.

        Raises:
            ValueError: not seven finite numbers.
        """
        compact = np.deg2rad(np.asarray(degrees, np.float64))
        travel = self.codec.travel_from_joints(self.codec.joints_from_compact(compact)) + np.array(self.slack)
        codes: NDArray[np.uint16] = self.codec.saturating_codes(self.codec.angles_from_travel(travel)).codes
        return codes

    def degrees(self, codes: ArrayLike) -> NDArray[np.float64]:
        """Return the angles (..., 7), degrees, of codes (..., 7)."""
        travel = self.codec.travel_from_angles(self.codec.angles_from_codes(np.asarray(codes)))
        degrees: NDArray[np.float64] = np.rad2deg(self.codec.compact_from_travel(travel - np.array(self.slack)))
        return degrees


def named(degrees: ArrayLike) -> dict[str, float]:
    """Return angles (7,), degrees, by name."""
    return dict(zip(POSITIONS, np.asarray(degrees, np.float64).tolist(), strict=True))


def listed(action: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return the angles (7,), degrees, of an action with numbers or one-element tensors as values.

    Raises:
        ValueError: an angle is missing; the message names the missing ones.
    """
    missing = [name for name in POSITIONS if name not in action]
    if missing:
        raise ValueError(f"an action needs all seven angles; missing: {', '.join(missing)}")
    return np.array([_number(action[name]) for name in POSITIONS])


def _number(value: Any) -> float:
    # a tensor may be on another device, and NumPy no longer converts an array of one element by float()
    return float(value.item() if hasattr(value, "item") else value)
