"""Surroundings of a hand: cube of the rotation task and its variation, light, sky. Add before compiling."""

from dataclasses import dataclass, fields, replace
from typing import Any

import mujoco
import numpy as np

CUBE_START = (0.11, 0.0, 0.05)
"""Nominal position above the palm, m."""
LOST_HEIGHT_M = -0.10
"""Threshold of the cube centre's height, world frame; below it the cube is lost. The paper's -0.05 m counts cubes that
are in the hand: gaits carry one at -0.03 m, and dip to -0.04."""
LOST_UNTOUCHED_S = 0.25
"""Threshold of the time without contact, s; above it the cube is lost. A carried cube has no contact for 0.1 s at most.
"""
WEDGED_Y_M, WEDGED_S, WEDGED_RAD_S = 0.035, 10.0, 0.1
"""A cube is wedged if it is further than this beside the middle of the hand (m), or turned more slowly than this
(rad/s) over the last seconds (s)."""
SETTLING_S = 0.5
"""Time for a placed cube to drop into the hand, s; without contact for a quarter of it under any policy."""


@dataclass(frozen=True)
class Cube:
    """Cube to be rotated; defaults from the paper's simulation (section "In-Hand Cube Rotation").

    Raises:
        ValueError: side, mass or friction not positive, or a centre of mass outside the cube.
    """

    side_m: float = 0.050
    mass_kg: float = 0.0692
    friction: float = 0.3
    """Sliding friction coefficient; a contact uses the larger of the cube's and the hand's 0.2."""
    centre_of_mass_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of mass relative to the cube's centre, m."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre_of_mass_m", tuple(self.centre_of_mass_m))
        off = max(map(abs, self.centre_of_mass_m))
        if not (self.side_m > 0 and self.mass_kg > 0 and self.friction > 0 and off < self.side_m / 2):
            raise ValueError(f"side, mass, friction must be positive and the centre of mass inside the cube: {self}")


CUBE = Cube()
RANGES = {"side_m": (0.045, 0.055), "mass_kg": (0.040, 0.140), "friction": (0.3, 1.0)}
"""Ranges of cube properties, assumed: puzzle cubes and wooden blocks of about the paper's size, smooth plastic to
rubber."""
OFF_CENTRE_M = 0.003
"""Largest distance of the centre of mass from the cube's centre, m."""
TAILS = {"side_m": (0.052, 0.055), "mass_kg": (0.110, 0.140), "friction": (0.8, 1.0)}
"""Difficult ends of `RANGES`: large, heavy and sticky cubes, which policies rotate slowly or drop."""


def any_cube(rng: np.random.Generator) -> Cube:
    """Draw a cube uniformly from `RANGES`, with its centre of mass off in a random direction."""
    values = {name: float(rng.uniform(*ends)) for name, ends in RANGES.items()}
    direction = rng.standard_normal(3)
    off = rng.uniform(0.0, OFF_CENTRE_M) * direction / np.linalg.norm(direction)
    return Cube(**values, centre_of_mass_m=tuple(off.tolist()))


def nearer(cube: Cube, share: float) -> Cube:
    """Interpolate from the paper's cube (`share` 0) to `cube` (`share` 1)."""
    ends = {field.name: (np.array(getattr(CUBE, field.name)), getattr(cube, field.name)) for field in fields(Cube)}
    return Cube(**{name: (paper + share * (other - paper)).tolist() for name, (paper, other) in ends.items()})


def tail_cube(rng: np.random.Generator) -> Cube:
    """Draw a cube with one random property from `TAILS`."""
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
        # The released scene has a torsional friction of 0.05 m, which acts only with soft skin (condim 4).
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
