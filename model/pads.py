"""Silicone pads of a hand, on the links that the paper names: fingertips, intermediate phalanges and palm.

The contact patch is that of Hertz's theory. Twisting resists with 3 pi / 16 of friction times radius, rolling with
3 / 16 of the radius times the share of the energy lost (Greenwood, Minshall and Tabor 1961), both per force.
"""

import math

import mujoco

from model.parameters import BuiltHandParameters
from model.softness import IMPEDANCE_MAX, constraint

FIXED = "palm"
"""Padded link that cannot move, so the compiler knows no inertia for its compliance."""
PADDED = (
    *(f"{finger}_{link}" for finger in ("index", "middle", "ring", "pinky") for link in ("middle", "distal")),
    "thumb_distal",
    FIXED,
)
"""Links with pads (paper, section "Mechanical design")."""
ROLLS_WITH_FRICTION = 6
"""MuJoCo's dimension of a contact that slides, twists and rolls with friction."""
PADS_DECIDE = 1
"""Priority of pads: friction belongs to the pair of surfaces, and the silicone dominates it."""

THICKNESS_M = 2e-3
"""Depth of a pad, m; a contact that deep is as hard as plastic (assumed)."""


def lay_pads(spec: mujoco.MjSpec, probe: mujoco.MjModel, unit: BuiltHandParameters) -> None:
    """Give the collision boxes of the padded links the contact of silicone; no effect at a friction of zero.

    The compliance holds for the links' inertia. A light object adds its own: a fingertip is twice as soft against 20 g,
    a fifth softer against 100 g.

    Args:
        spec: built hand.
        probe: the compiled hand.
        unit: parameters of the hand.
    """
    if not unit.pad_friction:
        return
    twist = 3.0 * math.pi / 16.0 * unit.pad_friction * unit.pad_patch
    roll = 3.0 / 16.0 * unit.pad_patch * unit.pad_loss
    for link in PADDED:
        for geom in spec.body(link).geoms:
            if geom.contype == 0:
                continue
            geom.friction = (unit.pad_friction, twist, roll)
            geom.condim, geom.priority = ROLLS_WITH_FRICTION, PADS_DECIDE
            if link != FIXED:
                inverse_mass = float(probe.body(link).invweight0[0])
                geom.solref, (softest, *_) = constraint(unit.pad_compliance, inverse_mass, unit.timestep)
                # At the full depth the bone carries the load; a constant compliance would let the thumb sink 7 mm.
                geom.solimp = (softest, IMPEDANCE_MAX, THICKNESS_M, 0.5, 2.0)
