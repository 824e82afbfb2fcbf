"""Built hand: joints and links of the mechanism, pulled by one-way cables on spools.

Each cable is a fixed tendon of length sum(c q) - r theta with a one-sided limit at minus its take-up: at the limit
the constraint force is the cable's tension, above it the cable is slack. Abduction has no spool; its shaft is the
joint itself (linkage, paper section "Kinematics and transmission").
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import CABLES, JOINT_BOX_RAD, Channel, Joint
from aero.side import Side
from model.pads import lay_pads
from model.parameters import LONGEST, STANDARD_GRAVITY, BuiltHandParameters
from model.softness import constraint
from simulator.appearance import CABLE_RGBA
from simulator.geometry import hand_geometry
from simulator.geometry.palm import THENAR_GUIDE
from simulator.geometry.winding import SPOOL_RADIUS, WINDING
from simulator.skeleton import COLLISION_GROUP, MECHANISM_GROUP, JointDynamics, build_skeleton, couple

COUPLING_COMPLIANCE = 0.002
"""Compliance of the PIP-DIP and thumb MCP-IP couplings, rad/(N m)."""
BINDING = "thumb_binding"
"""Tendon name of the soft stop of abduction where a thumb binds at the palm."""
BINDING_RECESS = 2.5
"""Recess of that stop by flexion, rad of abduction per rad of CMC; with the compliance fitted to the currents of one
owner's thumb (Jindongleee/aero-hand-mediapipe-teleop 6e7f9ab, config.py)."""
BINDING_COMPLIANCE = 0.43
"""Compliance of that stop, rad/(N m): thumb, pads and printed palm."""
SPOOL_ROW = (
    Channel.PINKY,
    Channel.RING,
    Channel.MIDDLE,
    Channel.INDEX,
    Channel.THUMB_CMC_FLEXION,
    Channel.THUMB_FLEXOR,
)
"""Order of the drawn spools behind the palm of a right hand, from +y to -y; without effect on the physics."""
SPOOL_SPACING = 0.022
"""Distance between drawn spools, m."""


def shaft_name(channel: Channel) -> str:
    """Return the joint name of a channel's output shaft."""
    return channel.label if channel is Channel.THUMB_ABDUCTION else f"{channel.label}_spool"


def cable_name(channel: Channel) -> str:
    """Return the tendon name of a channel's cable."""
    return f"{channel.label}_cable"


def build_built(side: Side = "right", parameters: BuiltHandParameters | None = None) -> mujoco.MjSpec:
    """Build the built hand.

    Sixteen joints, six spools, six cables, and seven motors in command order, controlled by the torque on the output
    shaft, N m, positive closes.

    Args:
        side: side of the hand.
        parameters: parameters of this hand; None for the defaults.

    Raises:
        ValueError: `side` is neither `right` nor `left`.
    """
    unit = parameters or BuiltHandParameters()
    spec = _assemble(side, unit)
    _soften(spec, unit)
    return spec


def _assemble(side: Side, unit: BuiltHandParameters) -> mujoco.MjSpec:
    description = hand_geometry(side)
    spec = build_skeleton(description, _joint_dynamics(unit))
    spec.modelname = f"aero_built_{side}"
    spec.option.timestep = unit.timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = STANDARD_GRAVITY * np.array(unit.down)
    if unit.gravity != STANDARD_GRAVITY:
        # Compensate the hand's own weight only; an object in the hand keeps its weight.
        for body in spec.bodies[1:]:
            body.gravcomp = 1.0 - unit.gravity / STANDARD_GRAVITY
    if not unit.contacts:
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 0
    couple(spec, description)
    if unit.thenar_radius:
        _add_thenar_stop(spec, unit)
    if unit.thumb_binding:
        binding = spec.add_tendon(name=BINDING, limited=mujoco.mjtLimited.mjLIMITED_TRUE, range=(-LONGEST, LONGEST))
        binding.wrap_joint(Joint.THUMB_ABDUCTION.label, 1.0)
    for channel in CABLES:
        _add_spool(spec, side, channel, unit)
        _add_cable(spec, channel, unit)
    for channel in Channel:
        spec.add_actuator(
            name=channel.label, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=shaft_name(channel)
        ).set_to_motor()
    # Back-EMF is an actuator too, so that a bound on the joint's actuators bounds the winding current.
    for channel in Channel:
        spec.add_actuator(
            name=f"{channel.label}_back_emf", trntype=mujoco.mjtTrn.mjTRN_JOINT, target=shaft_name(channel)
        ).set_to_motor()
    return spec


def _joint_dynamics(unit: BuiltHandParameters) -> JointDynamics:
    inertia, damping, friction = (
        np.array(values) for values in (unit.joint_inertia, unit.joint_damping, unit.joint_friction)
    )
    # The abduction joint is the output shaft of its servo.
    inertia[Joint.THUMB_ABDUCTION] += unit.rotor_inertia[Channel.THUMB_ABDUCTION]
    damping[Joint.THUMB_ABDUCTION] += unit.spool_damping[Channel.THUMB_ABDUCTION]
    friction[Joint.THUMB_ABDUCTION] += unit.spool_friction[Channel.THUMB_ABDUCTION]
    stiffness, relaxed = _springs(unit)
    return JointDynamics(
        armature=inertia,
        damping=damping,
        friction=friction,
        upper=np.array(unit.closed_stop),
        spring_stiffness=stiffness,
        spring_reference=relaxed,
    )


def _springs(unit: BuiltHandParameters) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the joints' spring rates, N m/rad, and relaxed angles, rad."""
    opened, closed = np.array(unit.spring_open), np.array(unit.spring_closed)
    # A constant torque is modelled as a very soft spring with a very distant relaxed angle.
    stiffness = np.maximum(closed - opened, 1e-6 * np.abs(opened)) / JOINT_BOX_RAD[:, 1]
    relaxed = -np.divide(opened, stiffness, out=np.zeros_like(opened), where=stiffness > 0.0)
    return stiffness, relaxed


def _add_thenar_stop(spec: mujoco.MjSpec, unit: BuiltHandParameters) -> None:
    """Add a contact between metacarpal and palm as on a physical hand; the boxes of the palm are too coarse."""
    solref, solimp = constraint(0.0, 1.0, unit.timestep)
    spec.body("palm").add_geom(
        name="thenar",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=(unit.thenar_radius, 0.0, 0.0),
        pos=spec.site(THENAR_GUIDE.name).pos,
        mass=0.0,
        contype=0,
        conaffinity=0,
        group=COLLISION_GROUP,
    )
    spec.add_pair(
        name="thenar_stop",
        geomname1="thenar",
        geomname2="thumb_metacarpal_box0",
        condim=1,
        solref=solref,
        solimp=solimp,
    )


def _add_spool(spec: mujoco.MjSpec, side: Side, channel: Channel, unit: BuiltHandParameters) -> None:
    y = SPOOL_SPACING * (len(SPOOL_ROW) / 2 - 0.5 - SPOOL_ROW.index(channel))
    body = spec.body("mount").add_body(name=shaft_name(channel), pos=(0.012, y if side == "right" else -y, 0.0))
    body.explicitinertial = True
    body.mass, body.inertia = 1e-3, (1e-8, 1e-8, 1e-8)
    body.add_joint(
        name=shaft_name(channel),
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=(0.0, 0.0, 1.0),
        armature=unit.rotor_inertia[channel],
        damping=unit.spool_damping[channel],
        frictionloss=unit.spool_friction[channel],
    )
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(SPOOL_RADIUS, 0.003, 0.0),
        contype=0,
        conaffinity=0,
        rgba=CABLE_RGBA["actuation"],
        group=MECHANISM_GROUP,
    )


def _add_cable(spec: mujoco.MjSpec, channel: Channel, unit: BuiltHandParameters) -> None:
    # A one-sided limit, because a cable only pulls. As an actuator clipped to pulling, the cable would be an explicit
    # stiff spring between spool and joints and need shorter steps; MuJoCo solves limits implicitly.
    tendon = spec.add_tendon(
        name=cable_name(channel),
        limited=mujoco.mjtLimited.mjLIMITED_TRUE,
        range=(-unit.cable_take_up[channel], LONGEST),
    )
    for joint, radius in winding(channel, unit).items():
        tendon.wrap_joint(joint.label, radius)
    tendon.wrap_joint(shaft_name(channel), -SPOOL_RADIUS)


def winding(channel: Channel, unit: BuiltHandParameters) -> dict[Joint, float]:
    """Return the winding radii of one cable on this hand, m/rad."""
    abduction = dict(zip((Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR), unit.abduction_winding, strict=True))
    return {
        joint: abduction[channel] if joint is Joint.THUMB_ABDUCTION else radius * unit.winding_scale[channel]
        for joint, radius in WINDING[channel].items()
    }


def _soften(spec: mujoco.MjSpec, unit: BuiltHandParameters) -> None:
    """Set the compliances, which depend on inertias computed by the MuJoCo compiler."""
    probe = spec.copy().compile()
    for channel in CABLES:
        tendon = spec.tendon(cable_name(channel))
        inverse_mass = float(probe.tendon_invweight0[probe.tendon(tendon.name).id])
        tendon.solref_limit, tendon.solimp_limit = constraint(unit.cable_compliance, inverse_mass, unit.timestep)
    if unit.thumb_binding:
        binding, inverse = spec.tendon(BINDING), float(probe.tendon_invweight0[probe.tendon(BINDING).id])
        binding.solref_limit, binding.solimp_limit = constraint(BINDING_COMPLIANCE, inverse, unit.timestep)
    # Stiff friction constraints, because with MuJoCo's default a loaded joint creeps by about 20 counts/s.
    holding = constraint(0.0, 1.0, unit.timestep)
    for name in (*(joint.label for joint in Joint), *map(shaft_name, CABLES)):
        target = spec.joint(name)
        target.solref_friction, target.solimp_friction = holding
    inverse_inertia = {joint: float(probe.dof_invweight0[probe.joint(joint.label).dofadr[0]]) for joint in Joint}
    for joint in Joint:
        target = spec.joint(joint.label)
        target.solref_limit, target.solimp_limit = constraint(
            unit.stop_compliance, inverse_inertia[joint], unit.timestep
        )
    for equality in spec.equalities:
        both = inverse_inertia[Joint[equality.name1.upper()]] + inverse_inertia[Joint[equality.name2.upper()]]
        equality.solref, equality.solimp = constraint(COUPLING_COMPLIANCE, both, unit.timestep)
    lay_pads(spec, probe, unit)
