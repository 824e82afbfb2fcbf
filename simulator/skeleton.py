"""Links, joints, contacts and passive parts of a hand as an `mujoco.MjSpec`, shared by routed and built hand."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import Joint
from simulator.appearance import PULLEY_RGBA, dress
from simulator.geometry.elements import Box, HandGeometry, Link, Pulley, Quaternion

GRAVITY = 9.81
"""Gravity along -z, m/s²."""
BOX_DENSITY = 1000.0
"""Density of links without given mass, kg/m³; gives the palm of the released model 0.364 kg."""
PLASTIC_FRICTION = 0.2
"""Sliding friction coefficient of printed parts; on the routed hand of all parts, where training randomises the
fingertips'."""
CONTACT_SOLREF = (0.02, 1.5)
CONTACT_SOLIMP = (0.9, 0.99, 0.001, 0.5, 2.0)

COLLISION_GROUP = 3
MECHANISM_GROUP = 1
GUIDE_GROUP = 4
PULLEY_QUATS: dict[str, Quaternion] = {"x": (0.5**0.5, 0.0, -(0.5**0.5), 0.0), "y": (0.5**0.5, -(0.5**0.5), 0.0, 0.0)}


@dataclass(frozen=True)
class JointDynamics:
    """Joint parameters of one hand; arrays are (16,) float in the order of `Joint`."""

    armature: NDArray[np.float64]
    """Reflected inertia, kg m²."""
    damping: NDArray[np.float64]
    """Viscous friction, N m s/rad."""
    friction: NDArray[np.float64]
    """Dry friction, N m."""
    upper: NDArray[np.float64]
    """Closed stop, rad; the extended stop is zero."""
    spring_stiffness: NDArray[np.float64]
    """Stiffness of return springs on the joint, N m/rad."""
    spring_reference: NDArray[np.float64]
    """Relaxed angle of the return springs, rad."""


def released_dynamics(geometry: HandGeometry) -> JointDynamics:
    """Return the dynamics of the released model's joints, with `geometry`'s own damping and stops."""
    rotor_inertia, gear_ratio = 0.371e-7, 205.0  # paper, "Numerical considerations"
    damping, upper = np.zeros(len(Joint)), np.zeros(len(Joint))
    for link in geometry.base.walk():
        if link.hinge:
            damping[link.hinge.joint] = link.hinge.damping
            upper[link.hinge.joint] = link.hinge.upper
    return JointDynamics(
        armature=np.full(len(Joint), rotor_inertia * gear_ratio**2),
        damping=damping,
        friction=np.full(len(Joint), 0.02),
        upper=upper,
        spring_stiffness=np.zeros(len(Joint)),
        spring_reference=np.zeros(len(Joint)),
    )


def build_skeleton(geometry: HandGeometry, dynamics: JointDynamics) -> mujoco.MjSpec:
    """Return a spec with the bodies, joints, contacts, pulleys and guides of `geometry`, without cables."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = (0.0, 0.0, -GRAVITY)
    _add_link(spec.worldbody, geometry.base, dynamics)
    for first, second in _left_out(geometry):
        spec.add_exclude(name=f"{first}_{second}", bodyname1=first, bodyname2=second)
    return spec


def couple(spec: mujoco.MjSpec, geometry: HandGeometry) -> None:
    """Add equality constraints to the coupled joints, PIP=DIP on each finger and MCP=IP on the thumb."""
    for follower, leader in geometry.couplings:
        spec.add_equality(
            name=f"{follower.label}_follows",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=follower.label,
            name2=leader.label,
            data=np.eye(1, mujoco.mjNEQDATA, 1)[0],
        )


def _add_link(parent: mujoco.MjsBody, link: Link, dynamics: JointDynamics) -> None:
    body = parent.add_body(name=link.name, pos=link.pos, quat=link.quat)
    if link.inertia:
        body.explicitinertial = True
        body.mass = link.inertia.mass
        body.ipos = link.inertia.centre
        body.iquat = link.inertia.quat
        body.inertia = link.inertia.moments
    if link.hinge:
        joint = link.hinge.joint
        body.add_joint(
            name=joint.label,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=link.hinge.axis,
            limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            range=(0.0, dynamics.upper[joint]),
            armature=dynamics.armature[joint],
            damping=dynamics.damping[joint],
            frictionloss=dynamics.friction[joint],
            stiffness=dynamics.spring_stiffness[joint],
            springref=dynamics.spring_reference[joint],
        )
    for index, box in enumerate(link.boxes):
        _add_box(body, f"{link.name}_box{index}", box)
    for pulley in link.pulleys:
        _add_pulley(body, pulley)
    for guide in link.guides:
        body.add_site(name=guide.name, pos=guide.pos, size=(0.0006, 0.0006, 0.0006), group=GUIDE_GROUP)
    dress(body, link)
    for child in link.links:
        _add_link(body, child, dynamics)


def _add_box(body: mujoco.MjsBody, name: str, box: Box) -> None:
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=box.half,
        pos=box.pos,
        quat=box.quat,
        density=BOX_DENSITY,
        group=COLLISION_GROUP,
        friction=(PLASTIC_FRICTION, 0.005, 0.0001),
        solref=CONTACT_SOLREF,
        solimp=CONTACT_SOLIMP,
    )


def _add_pulley(body: mujoco.MjsBody, pulley: Pulley) -> None:
    body.add_geom(
        name=pulley.name,
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(pulley.radius, pulley.half_length, 0.0),
        pos=pulley.pos,
        quat=PULLEY_QUATS[pulley.axis],
        mass=0.0,
        contype=0,
        conaffinity=0,
        group=MECHANISM_GROUP,
        rgba=PULLEY_RGBA,
    )


def _left_out(geometry: HandGeometry) -> list[tuple[str, str]]:
    """Return the pairs of links without contacts: palm and moving links except fingertips, mount and moving links.

    Their boxes overlap at the roots of the digits. MuJoCo itself excludes parent and child, and parts both fixed in the
    world.
    """
    moving = [link for link in geometry.base.walk() if link.hinge]
    return [
        *(("mount", link.name) for link in moving),
        *(("palm", link.name) for link in moving if link.links),
    ]
