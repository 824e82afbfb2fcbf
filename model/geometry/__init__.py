"""The mechanism as data: palm, one finger used four times, thumb, cables. The home of its numbers."""

from __future__ import annotations

from typing import Literal

from aero.channels import Joint
from model.geometry import finger, thumb
from model.geometry.elements import HandGeometry
from model.geometry.mirror import reflect
from model.geometry.palm import mount

Side = Literal["right", "left"]


def hand(side: Side = "right") -> HandGeometry:
    """Return the description of one hand.

    Raises:
        ValueError: `side` is neither `right` nor `left`.
    """
    if side not in ("right", "left"):
        raise ValueError(f"a hand is 'right' or 'left', not {side!r}")
    digits = (*map(finger.finger, finger.PLACEMENTS), thumb.DIGIT)
    right = HandGeometry(
        base=mount(digits, anchors=tuple(map(finger.anchor, finger.PLACEMENTS))),
        cables=(*(cable for place in finger.PLACEMENTS for cable in finger.cables(place)), *thumb.CABLES),
        couplings=(
            (Joint.INDEX_DIP, Joint.INDEX_PIP),
            (Joint.MIDDLE_DIP, Joint.MIDDLE_PIP),
            (Joint.RING_DIP, Joint.RING_PIP),
            (Joint.PINKY_DIP, Joint.PINKY_PIP),
            (Joint.THUMB_IP, Joint.THUMB_MCP),
        ),
    )
    return right if side == "right" else reflect(right)
