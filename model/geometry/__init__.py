"""The mechanism as data: palm, one finger used four times, thumb, cables. The home of its numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from aero.channels import Joint
from model.geometry import finger, thumb
from model.geometry.elements import Box, Guide, HandGeometry, Hinge, Inertia, Link, Pulley, Quaternion, Vector
from model.geometry.palm import mount


# The left hand is the right one reflected, never a second table. The plane is x-z of the mount, the symmetry plane
# between the two hands. Every frame is reflected along its own y, so a point (x, y, z) becomes (x, -y, z) in every link
# alike, and a rotation axis, being a pseudovector, (-x, y, -z).
def _point(v: Vector) -> Vector:
    x, y, z = v
    return x, -y, z


def _axis(v: Vector) -> Vector:
    x, y, z = v
    return -x, y, -z


def _rotation(q: Quaternion) -> Quaternion:
    w, x, y, z = q
    return w, -x, y, -z


def _box(box: Box) -> Box:
    return replace(box, pos=_point(box.pos), quat=_rotation(box.quat))


def _pulley(pulley: Pulley) -> Pulley:
    return replace(pulley, pos=_point(pulley.pos))


def _guide(guide: Guide) -> Guide:
    return replace(guide, pos=_point(guide.pos))


def _inertia(inertia: Inertia) -> Inertia:
    return replace(inertia, centre=_point(inertia.centre), quat=_rotation(inertia.quat))


def _hinge(hinge: Hinge) -> Hinge:
    return replace(hinge, axis=_axis(hinge.axis))


def _link(link: Link) -> Link:
    return replace(
        link,
        pos=_point(link.pos),
        quat=_rotation(link.quat),
        inertia=link.inertia and _inertia(link.inertia),
        hinge=link.hinge and _hinge(link.hinge),
        boxes=tuple(map(_box, link.boxes)),
        pulleys=tuple(map(_pulley, link.pulleys)),
        guides=tuple(map(_guide, link.guides)),
        links=tuple(map(_link, link.links)),
    )


def reflect(hand: HandGeometry) -> HandGeometry:
    """Return the other hand; names, paths, couplings and the sense of every joint stay."""
    return replace(hand, base=_link(hand.base))


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
