"""Conversion of physical compliance to MuJoCo's constraint parameters.

A MuJoCo constraint has a time constant T and an impedance d. With constant d, a violation r at rest produces the force
r / ((1 - d) A T²), where A is the inverse inertia along the constraint (`tendon_invweight0`, `dof_invweight0`). A
physical compliance c (violation per force) therefore needs 1 - d = c / (A T²). T is as short as the step allows, but
long enough to keep d above `IMPEDANCE_MIN`.
"""

from math import sqrt

IMPEDANCE_MIN, IMPEDANCE_MAX = 0.90, 0.9999
STEPS_PER_TIME_CONSTANT = 2.0
"""Least time constant in steps; MuJoCo's bound for a stable constraint."""

SolRef = tuple[float, float]
"""Time constant, s, and damping ratio."""
SolImp = tuple[float, float, float, float, float]
"""Constant impedance."""


def constraint(compliance: float, inverse_inertia: float, timestep: float) -> tuple[SolRef, SolImp]:
    """Return `solref` and `solimp` of a critically damped one-sided constraint with a static compliance.

    Args:
        compliance: violation per force, m/N or rad/(N m), not negative.
        inverse_inertia: inverse inertia of the constraint at the initial pose, 1/kg or 1/(kg m²).
        timestep: longest step, s; compliances too small for the step give the stiffest stable constraint.
    """
    time_constant = max(STEPS_PER_TIME_CONSTANT * timestep, sqrt(compliance / inverse_inertia / (1 - IMPEDANCE_MIN)))
    softness = compliance / (inverse_inertia * time_constant**2)
    impedance = min(1.0 - softness, IMPEDANCE_MAX)
    return (time_constant, 1.0), (impedance, impedance, 0.001, 0.5, 2.0)
