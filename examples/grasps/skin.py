"""What the silicone skin of a hand may be: a table of ranges, and a hand with a skin out of them.

The hand of `model` has none: one that holds nothing does not need it.
"""

from dataclasses import dataclass
from enum import StrEnum

import mujoco

from model.softness import constraint

FIXED = "palm"
"""The one link with a skin that cannot move, so that the compiler knows no inertia to make it soft against."""
COVERED = (
    *(f"{finger}_{link}" for finger in ("index", "middle", "ring", "pinky") for link in ("middle", "distal")),
    "thumb_distal",
    FIXED,
)
"""Links with a skin (paper, "Mechanical design": fingertips, intermediate phalanges and the contact surface of the
palm)."""
ALL_FRICTIONS = 6
"""MuJoCo's dimension of a contact that slides, twists and rolls with friction."""
DECIDES = 1
"""Priority: of a contact the skin's numbers count, whatever it touches."""


class Skin(StrEnum):
    """Of what the surface of a hand is."""

    PLASTIC = "plastic"
    """Printed, without a skin."""
    LEAST = "least"
    """Silicone that grips least: the low end of every friction, the hard end of the compliance."""
    SILICONE = "silicone"
    """The middle of the ranges."""
    MOST = "most"
    """Silicone that grips most."""


@dataclass(frozen=True)
class SkinNumber:
    """One number of the skin, from the silicone that grips least to the one that grips most."""

    name: str
    least: float
    middle: float
    most: float
    reason: str


NUMBERS = (
    SkinNumber(
        "friction",
        0.75,
        1.0,
        1.5,
        "the middle and the end of what training draws for the fingertips (paper, domain randomisation), and dry "
        "silicone on something smooth (assumed; it falls with pressure, Berthold et al. 2023, Meccanica 58, 2165)",
    ),
    SkinNumber(
        "twist",
        1.0e-3,
        1.6e-3,
        2.8e-3,
        "m; 3 pi / 16 of friction times contact radius (Hertz's pressure): 2.2 to 3.2 mm at 3 N on a pad of 6 mm "
        "radius and 1.0 to 0.3 MPa, Shore A 30 to 10 (hardness assumed: the paper says soft)",
    ),
    SkinNumber(
        "roll",
        0.04e-3,
        0.15e-3,
        0.3e-3,
        "m; 3/16 of the contact radius times the share of energy lost, 0.1 to 0.5 (Greenwood, Minshall and Tabor 1961)",
    ),
    SkinNumber(
        "compliance",
        0.1e-3,
        0.3e-3,
        0.6e-3,
        "m/N; Hertz's indentation of that pad at 3 N, 0.26 to 0.57 mm/N; less where the pad is thin",
    ),
)


def lay_skin(spec: mujoco.MjSpec, skin: Skin, timestep: float) -> None:
    """Give the collision boxes of the covered links of a built hand a skin; `timestep` (s) is the hand's.

    The compliance is made with the inertia of the links. A light object adds its own: one of 20 g makes a fingertip
    twice as soft as asked, one of 100 g by a fifth.
    """
    end = {Skin.LEAST: "least", Skin.SILICONE: "middle", Skin.MOST: "most"}.get(skin)
    if end is None:
        return
    at = {number.name: getattr(number, end) for number in NUMBERS}
    probe = spec.copy().compile()
    for link in COVERED:
        for geom in spec.body(link).geoms:
            if geom.contype == 0:
                continue
            geom.friction, geom.condim, geom.priority = (
                (at["friction"], at["twist"], at["roll"]),
                ALL_FRICTIONS,
                DECIDES,
            )
            if link != FIXED:
                inverse_mass = float(probe.body(link).invweight0[0])
                geom.solref, geom.solimp = constraint(at["compliance"], inverse_mass, timestep)
