"""Elements of the mechanism: links, hinges, boxes, pulleys and cable paths. Data only, no physics.

Lengths in m, masses in kg, moments in kg m², angles in rad; quaternions are (w, x, y, z). The frame of an element is
its link's, the frame of a link its parent's. Names are unique in the hand.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from aero.channels import Joint

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)

Role = Literal["actuation", "coupling", "mcp_spring", "distal_spring", "cmc_spring"]


@dataclass(frozen=True)
class Box:
    """Collision box."""

    half: Vector
    """Half sizes."""
    pos: Vector
    quat: Quaternion = IDENTITY


@dataclass(frozen=True)
class Pulley:
    """Cylinder that cables wrap around."""

    name: str
    radius: float
    half_length: float
    axis: Literal["x", "y"]
    pos: Vector


@dataclass(frozen=True)
class Guide:
    """Point on a cable's path, end point of a cable, or marker for the side of a pulley."""

    name: str
    pos: Vector


@dataclass(frozen=True)
class Inertia:
    """Mass properties of a link."""

    mass: float
    centre: Vector
    moments: Vector
    """Principal moments."""
    quat: Quaternion
    """Orientation of the principal axes."""


@dataclass(frozen=True)
class Hinge:
    """Joint between a link and its parent, at the origin of the link's frame; positive flexes (or abducts)."""

    joint: Joint
    axis: Vector
    upper: float
    """Angle at the closed stop, rad; the extended stop is zero."""
    damping: float
    """Viscous friction in the released model, N m s/rad."""


@dataclass(frozen=True)
class Link:
    """Rigid part with the links mounted on it."""

    name: str
    pos: Vector = (0.0, 0.0, 0.0)
    quat: Quaternion = IDENTITY
    inertia: Inertia | None = None
    """Mass properties; None derives them from the boxes at `BOX_DENSITY`."""
    hinge: Hinge | None = None
    """Joint to the parent; None is rigid."""
    boxes: tuple[Box, ...] = ()
    pulleys: tuple[Pulley, ...] = ()
    guides: tuple[Guide, ...] = ()
    links: tuple[Link, ...] = ()

    def walk(self) -> list[Link]:
        """Return this link and all below it, parents first."""
        return [self, *(below for link in self.links for below in link.walk())]


@dataclass(frozen=True)
class Around:
    """Turn of a path around a pulley."""

    pulley: str
    side: str | None = None
    """Guide on the side that the cable passes; None for the shorter path."""


@dataclass(frozen=True)
class Spring:
    """Linear extension spring along a path."""

    stiffness: float
    """N/m."""
    rest_length: float
    """Length of the whole path with the spring relaxed, m."""


@dataclass(frozen=True)
class Cable:
    """Path from guide to guide over pulleys."""

    name: str
    role: Role
    path: tuple[str | Around, ...]
    """Guides and turns, from the palm outwards."""
    spring: Spring | None = None
    """Spring along the path; None for inextensible cables."""


@dataclass(frozen=True)
class HandGeometry:
    """Links, cables and joint couplings of a hand."""

    base: Link
    """Mount, fixed in the world; root of all links."""
    cables: tuple[Cable, ...]
    """All 20 cables and springs."""
    couplings: tuple[tuple[Joint, Joint], ...]
    """Pairs of joints with equal angles, (follower, leader)."""
