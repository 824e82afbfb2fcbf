"""The cast silicone on a built hand: contacts that grip, twist and roll with friction, and give."""

from __future__ import annotations

import mujoco

from model.parameters import BuiltHandParameters
from model.softness import constraint

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
