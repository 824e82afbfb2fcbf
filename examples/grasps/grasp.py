"""What one grasp is: an object, where a person holds it out to the hand, and how the hand closes on it."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel

from .object_plant import HeldObject

Kind = Literal["power", "intermediate", "precision"]

FREE = (Channel.INDEX, Channel.MIDDLE, Channel.RING, Channel.PINKY, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
"""Channels that close on the object unless a grasp says otherwise; abduction always goes first."""

APERTURE = {"power": 1.0, "intermediate": 1.0, "precision": 0.15}
"""How far the channels that close on the object stand open before it is there, share of their travel."""


@dataclass(frozen=True)
class Grasp:
    """One grasp of the GRASP taxonomy (Feix et al. 2016) as this hand may make it."""

    number: int
    """In the taxonomy, 1 to 33."""
    name: str
    kind: Kind
    thing: HeldObject
    centre_mm: tuple[float, float, float]
    """Centre of the object in the hand's frame: x to the fingertips, y to the pinky, z out of the palm."""
    axis: tuple[float, float, float]
    """Direction of a cylinder's axis, or of the last edge of a box; the same frame."""
    closure: tuple[float, float, float, float, float, float, float]
    """Where the seven channels are sent in the end, shares of their joints' travel, 0 open, 1 closed."""
    touching: tuple[str, ...]
    """Parts of the hand that must touch the object, or it is another grasp: digits and `palm`. In a precision grasp it
    is the digits' last links that count, and the palm must not touch."""
    closing: tuple[Channel, ...] = FREE
    """Channels that close on the object; the others are in place before it is there."""
    aperture: float | None = None
    """How far those stand open before the object is there, share of their travel; `APERTURE` of the kind when None."""
    delays_s: tuple[float, ...] = (0.0,) * len(Channel)
    """When each channel begins to close on the object, from when it is there, s; in command order."""

    def before(self) -> tuple[float, ...]:
        """Return the closure of the channels before the object is there."""
        aperture = APERTURE[self.kind] if self.aperture is None else self.aperture
        return tuple(
            max(0.0, share - aperture) if channel in self.closing else share
            for channel, share in zip(Channel, self.closure, strict=True)
        )

    def closing_up(self) -> list[tuple[float, tuple[float, ...]]]:
        """Return when, s from the object's being there, which closure is sent; at the end all channels are closed."""
        return [
            (
                at,
                tuple(
                    end if delay <= at else start
                    for start, end, delay in zip(self.before(), self.closure, self.delays_s, strict=True)
                ),
            )
            for at in sorted(set(self.delays_s) | {0.0})
        ]

    def position_m(self) -> NDArray[np.float64]:
        """Return the centre of the object, (3,), m."""
        return 1e-3 * np.array(self.centre_mm)

    def orientation(self) -> NDArray[np.float64]:
        """Return the shortest turn that brings z to the axis, (4,), unit quaternion w x y z."""
        turned = np.empty(4)
        mujoco.mju_quatZ2Vec(turned, np.array(self.axis, dtype=float))
        return turned

    def shortfall(self, links: Collection[str]) -> str:
        """Say what the hand's links that touch the object lack, or have too much, for this grasp; empty for nothing."""
        missing = [
            part
            for part in self.touching
            if not any(link.startswith(part) and link.endswith(self.link_of(part)) for link in links)
        ]
        if missing:
            return f"not touched by {', '.join(missing)}"
        return "lies against the palm" if self.kind == "precision" and "palm" in links else ""

    def link_of(self, part: str) -> str:
        """Return how the names of the links of `part` end that may touch."""
        return "_distal" if self.kind == "precision" and part != "palm" else ""
