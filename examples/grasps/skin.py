"""Surfaces of a hand to make grasps with: hard plastic, or silicone pads from the one that grips least to the most."""

from dataclasses import dataclass, replace
from enum import StrEnum

from model import BuiltHandParameters


class Skin(StrEnum):
    """Of what the surface of a hand is."""

    PLASTIC = "plastic"
    """Printed, without pads."""
    LEAST = "least"
    """Silicone that grips least: the low end of every friction, the hard end of the compliance."""
    SILICONE = "silicone"
    """The middle of the ranges."""
    MOST = "most"
    """Silicone that grips most."""


@dataclass(frozen=True)
class SkinNumber:
    """One field of the pads, from the silicone that grips least to the one that grips most."""

    field: str
    least: float
    middle: float
    most: float
    reason: str


NUMBERS = (
    SkinNumber(
        "pad_friction",
        0.75,
        1.0,
        1.5,
        "the middle and the end of what training draws for the fingertips (paper, domain randomisation), and dry "
        "silicone on something smooth (assumed; it falls with pressure, Berthold et al. 2023, Meccanica 58, 2165)",
    ),
    SkinNumber("pad_patch", 2.26e-3, 2.7e-3, 3.17e-3, "m; as `BuiltHandParameters.pad_patch`"),
    SkinNumber("pad_loss", 0.1, 0.3, 0.5, "as `BuiltHandParameters.pad_loss`"),
    SkinNumber("pad_compliance", 0.1e-3, 0.3e-3, 0.6e-3, "m/N; as `BuiltHandParameters.pad_compliance`"),
)


def with_skin(hand: BuiltHandParameters, skin: Skin) -> BuiltHandParameters:
    """Return the hand with this surface."""
    end = {Skin.LEAST: "least", Skin.SILICONE: "middle", Skin.MOST: "most"}.get(skin)
    pads = {"pad_friction": 0.0} if end is None else {number.field: getattr(number, end) for number in NUMBERS}
    return replace(hand, **pads)
