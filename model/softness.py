"""What gives: physical compliance as MuJoCo's constraint parameters, and the cast silicone on a built hand.

A MuJoCo constraint has a time constant T and an impedance d. With d constant, a violation r at rest is held by the
force r / ((1 - d) A T²), where A is the inverse inertia along the constraint that the compiler stores
(`tendon_invweight0`, `dof_invweight0`). So a physical compliance c (violation per force) is met by
1 - d = c / (A T²); T is as short as the step allows unless d would leave the range in which that is well behaved.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import mujoco

from model.parameters import BuiltHandParameters

IMPEDANCE_MIN, IMPEDANCE_MAX = 0.90, 0.9999
STEPS_PER_TIME_CONSTANT = 2.0
"""MuJoCo's own lower bound for a stable constraint."""

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


@dataclass(frozen=True)
class Constraint:
    """The pair of parameters MuJoCo takes."""

    solref: tuple[float, float]
    """Time constant, s, and damping ratio."""
    solimp: tuple[float, float, float, float, float]
    """Constant impedance."""


def constraint(compliance: float, inverse_inertia: float, timestep: float) -> Constraint:
    """Return a critically damped one-sided constraint of a given static compliance.

    Args:
        compliance: violation per force, m/N or rad/(N m), not negative.
        inverse_inertia: of the constraint at the initial pose, 1/kg or 1/(kg m²).
        timestep: longest step, s; a compliance too small for it gives the stiffest constraint there is.
    """
    time_constant = max(STEPS_PER_TIME_CONSTANT * timestep, sqrt(compliance / inverse_inertia / (1 - IMPEDANCE_MIN)))
    softness = compliance / (inverse_inertia * time_constant**2)
    impedance = min(1.0 - softness, IMPEDANCE_MAX)
    return Constraint((time_constant, 1.0), (impedance, impedance, 0.001, 0.5, 2.0))


def lay_skin(spec: mujoco.MjSpec, probe: mujoco.MjModel, unit: BuiltHandParameters) -> None:
    """Give the collision boxes of the covered links the unit's skin.

    Args:
        spec: of the hand.
        probe: the same, compiled: gives the inertias behind the compliance. A light object adds its own: one of 20 g
            makes a fingertip twice as soft as asked, one of 100 g by a fifth.
        unit: with a skin.
    """
    friction = unit.skin_friction, unit.skin_twist, unit.skin_roll
    for link in COVERED:
        soft = None
        if link != FIXED:
            soft = constraint(unit.skin_compliance, float(probe.body(link).invweight0[0]), unit.timestep)
        for geom in spec.body(link).geoms:
            if geom.contype == 0:
                continue
            geom.friction, geom.condim, geom.priority = friction, ALL_FRICTIONS, DECIDES
            if soft:
                geom.solref, geom.solimp = soft.solref, soft.solimp
