"""Geometry of the mechanism as data: palm, four copies of one finger, thumb, cables."""

from dataclasses import fields, is_dataclass, replace
from operator import mul
from typing import Any

from aero.channels import Joint
from aero.side import Side
from simulator.geometry import finger, thumb
from simulator.geometry.elements import HandGeometry
from simulator.geometry.palm import mount

# The left hand is a reflection of the right one, because a second table could differ from the first by mistake. The
# plane is x-z of the mount, the symmetry plane between the two hands. Every frame is reflected along its own y: in all
# links a point (x, y, z) becomes (x, -y, z), and a rotation, whose axis is a pseudovector, changes sign in x and z.
SIGNS = {"pos": (1, -1, 1), "centre": (1, -1, 1), "axis": (-1, 1, -1), "quat": (1, -1, 1, -1)}
"""Sign changes under reflection, by field name; a pulley's axis is a line without direction and keeps its value."""


def reflect(part: Any) -> Any:
    """Return the mirrored part; names, paths, couplings and the positive direction of every joint are unchanged."""
    if isinstance(part, tuple):
        return tuple(map(reflect, part))
    if not is_dataclass(part) or isinstance(part, type):
        return part
    return replace(part, **{field.name: _reflected(field.name, getattr(part, field.name)) for field in fields(part)})


def _reflected(name: str, value: Any) -> Any:
    turned = name in SIGNS and isinstance(value, tuple)
    return tuple(map(mul, value, SIGNS[name])) if turned else reflect(value)


def hand_geometry(side: Side = "right") -> HandGeometry:
    """Return the geometry of one hand.

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
    return right if side == "right" else replace(right, base=reflect(right.base))
