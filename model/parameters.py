"""Parameters of one built hand: all deviations from rigid, frictionless CAD.

Zero disables an effect; a compliance of zero is as stiff as the step allows. Arrays over channels are in command order,
arrays over joints in the order of `Joint`.

The defaults describe a plausible hand, not a fitted one. Sources: loads and speeds of one physical hand (public logs
June-July 2026, TTdragoAlex/tetherIA-aero-hand-open 58b518e; one count of servo error is about 0.0051 N m at the spool),
and the paper's transmission section.
"""

from dataclasses import dataclass, fields

import numpy as np

from aero.channels import JOINT_BOX_RAD, Joint
from firmware_emulator.servo.parameters import HLS3606M
from simulator.geometry.palm import THENAR_RADIUS
from simulator.geometry.winding import ABDUCTION_RADIUS

STANDARD_GRAVITY = 9.81
"""m/s²."""
Channels = tuple[float, ...]
Joints = tuple[float, ...]

_CLOSED_STOP = (*(1.527,) * 12, 1.871, *map(float, JOINT_BOX_RAD[Joint.THUMB_CMC :, 1]))
_SPRING_OPEN = (*(0.055, 0.060, 0.075) * 4, 0.0, 0.063, 0.017, 0.020)
_SPRING_CLOSED = (*(0.085, 0.100, 0.120) * 4, 0.0, 0.160, 0.110, 0.130)
_SPOOL_FRICTION = (0.034, 0.025, 0.034, 0.030, 0.025, 0.043, 0.017)


LONGEST = 1.0
"""Limit of a cable's length, m, which no cable of the hand reaches."""


@dataclass(frozen=True)
class BuiltHandParameters:
    """Mechanics of one hand behind its servos' output shafts."""

    rotor_inertia: Channels = (7.5e-4,) * 7
    """Inertia of motor and gears at the output shaft, kg m²; from a motor time constant of 12-16 ms."""
    back_emf: float = HLS3606M.back_emf
    """Torque lost per speed of a driven winding, N m s/rad; a unit takes the value of its servos."""
    supply_ratio: float = 1.0
    """Supply voltage over nominal; scales a servo's torque."""
    supply_sag: float = 0.0
    """Fraction of the supply voltage lost per sum over motors of duty times current, both as torque, 1/(N m)²; at 0.1
    the supply sags by 24 % when all seven stall."""
    spool_friction: Channels = _SPOOL_FRICTION
    """Dry friction of gears and spool, N m; Coulomb part of the recorded static errors."""
    spool_damping: Channels = (0.0,) * 7
    """Viscous friction of gears and spool, also unpowered, N m s/rad."""
    cable_friction: Channels = (0.0,) * 7
    """Dry friction of a cable in its guides, fraction of its tension (capstan); the abduction entry is unused."""
    cable_friction_spread: float = 0.0
    """Standard deviation of the cable friction between motions, fraction of the friction."""
    cable_take_up: Channels = (0.0,) * 7
    """Cable wound in at the extended pose until taut, m; the abduction entry is unused. A negative value is pretension:
    with the shaft at zero the cable is short by this length and may keep the hand partly closed."""
    cable_compliance: float = 5.4e-6
    """Stretch of a cable, m/N; 0.35 mm at 65 N."""
    winding_scale: Channels = (1.0,) * 7
    """Winding radii over those of CAD; the abduction entry is unused."""
    abduction_winding: tuple[float, float] = (ABDUCTION_RADIUS, ABDUCTION_RADIUS)
    """Winding radius of abduction on the CMC and the flexor cable, m/rad; zero uncouples them."""
    spring_open: Joints = _SPRING_OPEN
    """Opening torque of the return springs at the extended stop, N m; 5 N of cable as recorded. Negative closes."""
    spring_closed: Joints = _SPRING_CLOSED
    """Opening torque of the return springs at the closed end of the joint box, N m; 11-18 N of cable as recorded."""
    joint_friction: Joints = (0.004,) * 16
    """Dry friction of a joint, N m."""
    joint_damping: Joints = (0.004,) * 16
    """Viscous friction of a joint, N m s/rad."""
    joint_inertia: Joints = (2.0e-5,) * 16
    """Inertia added to a joint, kg m², for silicone, pins and cable, which the rigid links lack."""
    closed_stop: Joints = _CLOSED_STOP
    """Closed end stops, rad; fingers blocked at 0.976-0.979 of 288.16°, abduction 1.871 rad (paper, kinematic test)."""
    thenar_radius: float = THENAR_RADIUS
    """Radius of the palm's stop for the metacarpal in flexion without abduction, m; zero for none."""
    thumb_binding: float = 0.0
    """Abduction below which the extended thumb binds at the palm, rad; zero for a healthy thumb. Flexion of the CMC
    frees it: `model.built.BINDING_RECESS`."""
    stop_compliance: float = 0.005
    """Compliance of a joint's end stops, rad/(N m); printed parts, assumed."""
    pad_friction: float = 0.7
    """Sliding friction coefficient of the silicone pads against any object; zero for printed plastic without pads. The
    middle of the paper's randomisation of the fingertips, 0.5 to 1.0."""
    pad_patch: float = 2.7e-3
    """Radius of a pad's contact patch, m. Hertz: 2.2 to 3.2 mm at 3 N on a pad of 6 mm radius and 1.0 to 0.3 MPa, Shore
    A 30 to 10 (hardness assumed: the paper says soft)."""
    pad_loss: float = 0.3
    """Share of the energy lost in rolling on a pad; silicone 0.1 to 0.5 (assumed)."""
    pad_compliance: float = 0.25e-3
    """Indentation of a pad per force, m/N. Hertz: 0.26 to 0.57 mm/N at 3 N on that pad; less where the pad is thin."""
    gravity: float = STANDARD_GRAVITY
    """Gravity on the hand's own parts, m/s²; objects always have their full weight."""
    down: tuple[float, float, float] = (0.0, 0.0, -1.0)
    """Direction of gravity in the hand's frame, unit vector; by default palm up."""
    contacts: bool = True
    """Contacts between digits and with the palm; the thenar stop acts regardless."""
    timestep: float = 0.002
    """Longest step of the physics, s."""

    def __post_init__(self) -> None:
        for field in fields(self):
            values = np.atleast_1d(np.asarray(getattr(self, field.name), dtype=float))
            expected = np.size(getattr(type(self), field.name))
            if values.shape != (expected,):
                raise ValueError(f"{field.name} has {expected} values, not shape {values.shape}")
            signed = field.name in {"cable_take_up", "spring_open", "spring_closed", "down"}
            if not np.all(np.isfinite(values)) or (np.any(values < 0) and not signed):
                raise ValueError(f"{field.name} must be finite and not negative, not {getattr(self, field.name)}")
        if np.min(self.cable_take_up) <= -LONGEST:
            raise ValueError(f"cable_take_up must be above {-LONGEST:g} m, not {min(self.cable_take_up):g}")
        less = np.less(self.spring_closed, self.spring_open)
        if np.any(less):
            joint = Joint(int(np.argmax(less)))
            raise ValueError(
                f"{joint.label}: a return spring cannot pull less closed than open, "
                f"{self.spring_closed[joint]} N m against {self.spring_open[joint]} N m"
            )
        if abs(np.linalg.norm(self.down) - 1.0) > 1e-6:
            raise ValueError(f"down must have length 1, not {np.linalg.norm(self.down):g}")
        for name in ("rotor_inertia", "joint_inertia", "closed_stop", "winding_scale", "timestep", "supply_ratio"):
            if np.any(np.asarray(getattr(self, name)) == 0):
                raise ValueError(f"{name} must be positive; a hand without it has no equations of motion")
