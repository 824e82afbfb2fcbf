"""What a person would vary in a grasp, as a vector: closures, order in time, object's place, direction and size."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel

from .grasp import APERTURE, Grasp

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Kind:
    """Numbers of one kind in the vector."""

    count: int
    scale: float
    """Of what the vector holds; a step of 0.1 in it should matter alike for all."""
    low: float
    high: float
    """Bounds of the number itself."""


KINDS = {
    "closure": Kind(7, 1.0, 0.0, 1.0),
    "aperture": Kind(1, 1.0, 0.05, 1.0),
    "delays_s": Kind(7, 2.0, 0.0, 0.4),
    "centre_mm": Kind(3, 80.0, -120.0, 220.0),
    "turn_rad": Kind(2, 2.0, -1.5, 1.5),
    "log_size": Kind(1, 2.0, np.log(0.75), np.log(4.0 / 3.0)),
}
"""The turn of the axis and the size are counted from a template's. The taxonomy orders grasps by the object's size and
gives no millimetres: the size may become a third larger or a quarter smaller than the template's."""
_ENDS = np.cumsum([kind.count for kind in KINDS.values()])
SIZE = int(_ENDS[-1])
_PLACES = {name: slice(int(end) - kind.count, int(end)) for (name, kind), end in zip(KINDS.items(), _ENDS, strict=True)}
CLOSURE, CENTRE = _PLACES["closure"], _PLACES["centre_mm"]
"""Where the closures of the channels and the object's place stand in the vector."""
SCALES = np.concatenate([np.full(kind.count, kind.scale) for kind in KINDS.values()])
LOW, HIGH = (
    np.concatenate([np.full(kind.count, getattr(kind, end) / kind.scale) for kind in KINDS.values()])
    for end in ("low", "high")
)
"""Bounds of the vector, (`SIZE`,)."""


def vector_of(grasp: Grasp) -> Vector:
    """Return a grasp as a vector, (`SIZE`,), with itself as the template."""
    aperture = APERTURE[grasp.kind] if grasp.aperture is None else grasp.aperture
    numbers = np.concatenate([grasp.closure, [aperture], grasp.delays_s, grasp.centre_mm, np.zeros(3)])
    vector: Vector = np.clip(numbers / SCALES, LOW, HIGH)
    return vector


def grasp_of(vector: Vector, template: Grasp) -> Grasp:
    """Return the grasp that a vector, (`SIZE`,), means; what is not in it is the template's."""
    numbers = np.clip(vector, LOW, HIGH) * SCALES
    closure, aperture, delays, centre, turn, size = np.split(numbers, _ENDS[:-1])
    factor = float(np.exp(size[0]))
    thing = replace(template.thing, size_mm=tuple(round(factor * edge, 1) for edge in template.thing.size_mm))
    closes = [channel in template.closing for channel in Channel]
    return replace(
        template,
        thing=thing,
        centre_mm=tuple(centre.round(1).tolist()),
        axis=_turned(template.axis, turn),
        closure=tuple(closure.round(3).tolist()),
        aperture=round(float(aperture[0]), 3),
        delays_s=tuple(np.where(closes, delays, 0.0).round(2).tolist()),
    )


def _turned(axis: tuple[float, float, float], turn: Vector) -> tuple[float, float, float]:
    """Return the unit axis turned by `turn`, (2,) rad, about two directions across it."""
    along = np.array(axis) / np.linalg.norm(axis)
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    angle = float(np.linalg.norm(turn))
    sideways = (turn[0] * across + turn[1] * np.cross(along, across)) / max(angle, 1e-12)
    x, y, z = (np.cos(angle) * along + np.sin(angle) * sideways).round(4).tolist()
    return x, y, z
