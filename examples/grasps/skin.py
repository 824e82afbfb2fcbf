"""What the silicone skin of a hand may be: a table of ranges, and a unit with a skin out of them.

No unit has a skin by itself. A hand that holds nothing does not need one.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from enum import StrEnum

from model.units import Unit


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

    field: str
    """Of `BuiltHandParameters`."""
    least: float
    middle: float
    most: float
    reason: str


NUMBERS = (
    SkinNumber(
        "skin_friction",
        0.75,
        1.0,
        1.5,
        "the middle and the end of what training draws for the fingertips (paper, domain randomisation), and dry "
        "silicone on something smooth (assumed; it falls with pressure, Berthold et al. 2023, Meccanica 58, 2165)",
    ),
    SkinNumber(
        "skin_twist",
        1.0e-3,
        1.6e-3,
        2.8e-3,
        "m; 3 pi / 16 of friction times contact radius (Hertz's pressure): 2.2 to 3.2 mm at 3 N on a pad of 6 mm "
        "radius and 1.0 to 0.3 MPa, Shore A 30 to 10 (hardness assumed: the paper says soft)",
    ),
    SkinNumber(
        "skin_roll",
        0.04e-3,
        0.15e-3,
        0.3e-3,
        "m; 3/16 of the contact radius times the share of energy lost, 0.1 to 0.5 (Greenwood, Minshall and Tabor 1961)",
    ),
    SkinNumber(
        "skin_compliance",
        0.1e-3,
        0.3e-3,
        0.6e-3,
        "m/N; Hertz's indentation of that pad at 3 N, 0.26 to 0.57 mm/N; less where the pad is thin",
    ),
)


def with_skin(unit: Unit, skin: Skin) -> Unit:
    """Return the unit with this surface in place of its own."""
    end = {Skin.LEAST: "least", Skin.SILICONE: "middle", Skin.MOST: "most"}.get(skin)
    at = {number.field: getattr(number, end) if end else 0.0 for number in NUMBERS}
    hand = dataclasses.replace(
        unit.hand,
        skin_friction=at["skin_friction"],
        skin_twist=at["skin_twist"],
        skin_roll=at["skin_roll"],
        skin_compliance=at["skin_compliance"],
    )
    return dataclasses.replace(unit, hand=hand)
