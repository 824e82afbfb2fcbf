"""Realistic cubes: what differs from one to the next, one property at a time and all at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from model.scene import CUBE, Cube

LOST_HEIGHT_M = -0.05
"""Height of the cube's centre below which it is lost, world frame (paper, section "Learning In-Hand Cube Rotation")."""
SETTLING_S = 0.5
"""Time in which a placed cube drops into the hand: without contact for a quarter of it, whatever is done."""


@dataclass(frozen=True)
class Property:
    """One thing in which cubes differ."""

    name: str
    unit: str
    """For people."""
    scale: float
    """From SI to `unit`."""
    values: tuple[float, ...]
    """SI; from end to end of what cubes have."""
    change: Callable[[Cube, float], Cube]
    """Gives a cube another value."""

    def label(self, value: float) -> str:
        """Return a value (SI) for tables."""
        return f"{self.name} {value * self.scale:g} {self.unit}".strip()


def _off_centre(cube: Cube, by_m: float) -> Cube:
    return replace(cube, centre_of_mass_m=(by_m, 0.0, 0.0))


PROPERTIES = (
    Property("side", "mm", 1e3, (0.045, 0.0475, 0.050, 0.0525, 0.055), lambda cube, x: replace(cube, side_m=x)),
    Property("mass", "g", 1e3, (0.040, 0.0692, 0.100, 0.140), lambda cube, x: replace(cube, mass_kg=x)),
    Property("friction", "", 1.0, (0.3, 0.5, 0.7, 1.0), lambda cube, x: replace(cube, friction=x)),
    Property("centre of mass off by", "mm", 1e3, (0.0, 0.0015, 0.003), _off_centre),
)
"""The paper's cube, 50 mm, 69.2 g and 0.3, is one of each. The ranges are an assumption of what people have: puzzle
cubes and wooden blocks of about this size, smooth plastic to rubber."""


TAILS = {"side": (0.052, 0.055), "mass": (0.110, 0.140), "friction": (0.8, 1.0)}
"""Ends of the ranges, SI, where policies are slow or drop the cube: large, heavy and sticky ones."""


def any_cube(rng: np.random.Generator) -> Cube:
    """Draw a cube, each property uniformly from end to end, its centre of mass along a random direction."""
    cube = CUBE
    for one in PROPERTIES[:-1]:
        cube = one.change(cube, float(rng.uniform(min(one.values), max(one.values))))
    direction = rng.standard_normal(3)
    off = rng.uniform(0.0, max(PROPERTIES[-1].values)) * direction / np.linalg.norm(direction)
    return replace(cube, centre_of_mass_m=tuple(off.tolist()))


def nearer(cube: Cube, share: float) -> Cube:
    """Return a cube that has gone this share of the way from the paper's to `cube`, 0 to 1."""
    values = {field.name: getattr(cube, field.name) for field in fields(Cube)}
    paper = {name: np.array(getattr(CUBE, name)) for name in values}
    way = {name: paper[name] + share * (np.array(value) - paper[name]) for name, value in values.items()}
    return Cube(**{name: value.tolist() for name, value in way.items()})


def tail_cube(rng: np.random.Generator) -> Cube:
    """Draw a cube that has one property from its tail."""
    cube, name = any_cube(rng), str(rng.choice(list(TAILS)))
    (one,) = (one for one in PROPERTIES if one.name == name)
    return one.change(cube, float(rng.uniform(*TAILS[name])))
