"""What stands around a hand: the cube of the rotation task, how cubes differ, light, sky. Add before compiling."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import mujoco
import numpy as np

CUBE_START = (0.11, 0.0, 0.05)
"""Nominal position above the palm, m."""
LOST_HEIGHT_M = -0.05
"""Height of the cube's centre below which it is lost, world frame (paper, section "Learning In-Hand Cube Rotation")."""
SETTLING_S = 0.5
"""Time in which a placed cube drops into the hand: without contact for a quarter of it, whatever is done."""


@dataclass(frozen=True)
class Cube:
    """What is turned in the hand; the defaults are the paper's simulated cube (section "In-Hand Cube Rotation").

    Raises:
        ValueError: a side, mass or friction that is not positive, or a centre of mass outside the cube.
    """

    side_m: float = 0.050
    mass_kg: float = 0.0692
    friction: float = 0.3
    """Coefficient of sliding; of a contact the larger of the two bodies' counts, and the hand's is 0.2."""
    centre_of_mass_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """From its centre."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre_of_mass_m", tuple(self.centre_of_mass_m))
        off = max(map(abs, self.centre_of_mass_m))
        if not (self.side_m > 0 and self.mass_kg > 0 and self.friction > 0 and off < self.side_m / 2):
            raise ValueError(f"side, mass, friction must be positive and the centre of mass inside the cube: {self}")


CUBE = Cube()
RANGES = {"side_m": (0.045, 0.055), "mass_kg": (0.040, 0.140), "friction": (0.3, 1.0)}
"""From end to end of what cubes have, an assumption: puzzle cubes and wooden blocks of about the paper's size, smooth
plastic to rubber."""
OFF_CENTRE_M = 0.003
"""Farthest that a centre of mass is from the middle of its cube."""
TAILS = {"side_m": (0.052, 0.055), "mass_kg": (0.110, 0.140), "friction": (0.8, 1.0)}
"""Ends of the ranges where policies are slow or drop the cube: large, heavy and sticky ones."""


def any_cube(rng: np.random.Generator) -> Cube:
    """Draw a cube, each property uniformly from end to end, its centre of mass along a random direction."""
    values = {name: float(rng.uniform(*ends)) for name, ends in RANGES.items()}
    direction = rng.standard_normal(3)
    off = rng.uniform(0.0, OFF_CENTRE_M) * direction / np.linalg.norm(direction)
    return Cube(**values, centre_of_mass_m=tuple(off.tolist()))


def nearer(cube: Cube, share: float) -> Cube:
    """Return a cube that has gone this share of the way from the paper's to `cube`, 0 to 1."""
    ends = {field.name: (np.array(getattr(CUBE, field.name)), getattr(cube, field.name)) for field in fields(Cube)}
    return Cube(**{name: (paper + share * (other - paper)).tolist() for name, (paper, other) in ends.items()})


def tail_cube(rng: np.random.Generator) -> Cube:
    """Draw a cube that has one property from its tail."""
    cube, name = any_cube(rng), str(rng.choice(list(TAILS)))
    value: Any = float(rng.uniform(*TAILS[name]))
    return replace(cube, **{name: value})


def add_cube(spec: mujoco.MjSpec, cube: Cube = CUBE) -> mujoco.MjsBody:
    """Add the free cube (`cube`, free joint `cube`) at its nominal start and return its body."""
    half = cube.side_m / 2
    body = spec.worldbody.add_body(name="cube", pos=CUBE_START)
    body.add_freejoint(name="cube")
    body.add_geom(
        name="cube",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(half, half, half),
        mass=cube.mass_kg,
        # Torsional friction is 0.05 m in the released scene; it acts on soft skin alone (condim 4).
        friction=(cube.friction, 0.005, 0.0001),
        rgba=(0.90, 0.55, 0.15, 1.0),
    )
    if any(cube.centre_of_mass_m):
        body.explicitinertial = True
        body.mass, body.ipos = cube.mass_kg, cube.centre_of_mass_m
        body.inertia = (cube.mass_kg * cube.side_m**2 / 6,) * 3
    return body


def add_light(spec: mujoco.MjSpec) -> None:
    """Add two lamps and a bright sky for pictures."""
    for name, direction in (("key_light", (0.3, 0.4, -0.85)), ("fill_light", (-0.4, -0.5, -0.6))):
        spec.worldbody.add_light(
            name=name,
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            dir=direction,
            diffuse=(0.45, 0.45, 0.45),
            castshadow=False,
        )
    spec.visual.headlight.ambient = (0.35, 0.35, 0.35)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.97, 0.98, 1.0),
        rgb2=(0.80, 0.84, 0.90),
        width=64,
        height=384,
    )
