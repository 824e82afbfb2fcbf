"""The words the mechanism is written in: links, hinges, boxes, pulleys and cable paths. Data only, no physics.

Lengths in m, masses in kg, moments in kg m², angles in rad; quaternions are (w, x, y, z). Every element is given in
the frame of the link that carries it, a link in that of its parent. Names are unique in the hand.
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
    """A collision box."""

    half: Vector
    """Half sizes."""
    pos: Vector
    quat: Quaternion = IDENTITY


@dataclass(frozen=True)
class Pulley:
    """A cylinder that cables wrap around."""

    name: str
    radius: float
    """Of the groove."""
    half_length: float
    axis: Literal["x", "y"]
    pos: Vector


@dataclass(frozen=True)
class Guide:
    """A point that a cable passes through, ends at, or that marks the side of a pulley it takes."""

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
    """The joint between a link and its parent, at the origin of the link's frame; positive flexes (or abducts)."""

    joint: Joint
    axis: Vector
    upper: float
    """Angle at the closed stop, rad; the extended stop is zero."""
    damping: float
    """Viscous friction in the released model, N m s/rad."""


@dataclass(frozen=True)
class Link:
    """A rigid part and what hangs on it."""

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
    """Mounted on this one."""

    def walk(self) -> list[Link]:
        """Return this link and all below it, parents first."""
        return [self, *(below for link in self.links for below in link.walk())]


@dataclass(frozen=True)
class Around:
    """One turn of a path around a pulley."""

    pulley: str
    side: str | None = None
    """Guide on the side the cable takes; None leaves the shorter way."""


@dataclass(frozen=True)
class Spring:
    """A linear extension spring in line with a path."""

    stiffness: float
    """N/m."""
    rest_length: float
    """Length of the whole path at which it is relaxed, m."""


@dataclass(frozen=True)
class Cable:
    """A path from guide to guide over pulleys."""

    name: str
    role: Role
    path: tuple[str | Around, ...]
    """Guides and turns in order from the palm outwards."""
    spring: Spring | None = None
    """What pulls along the path, None for inextensible cables."""


@dataclass(frozen=True)
class HandGeometry:
    """One whole hand."""

    base: Link
    """The mount, fixed in the world, with everything on it."""
    cables: tuple[Cable, ...]
    """Twenty paths."""
    couplings: tuple[tuple[Joint, Joint], ...]
    """Pairs of joints that turn by equal angles, (follower, leader)."""
