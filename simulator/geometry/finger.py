"""Geometry common to the four fingers, and their placements on the palm.

Source: released tendon model `AeroCubeRotateZAxis` (MuJoCo Playground 0.2.0); springs also in the paper, section
"Cable transmission as spatial tendons". Link frames: x along the joint axes, -y palmar, z distal.
"""

from dataclasses import dataclass
from math import pi

from aero.channels import Channel, Joint
from simulator.geometry.elements import (
    IDENTITY,
    Around,
    Box,
    Cable,
    Guide,
    Hinge,
    Inertia,
    Link,
    Pulley,
    Quaternion,
    Spring,
    Vector,
)

X_AXIS: Vector = (1.0, 0.0, 0.0)
MCP_SPRING = Spring(stiffness=352.0, rest_length=0.011376)
DISTAL_SPRING = Spring(stiffness=4000.0, rest_length=0.021336)


@dataclass(frozen=True)
class Placement:
    """Differences between the four fingers."""

    channel: Channel
    knuckle_pos: Vector
    """Position of the knuckle in the palm's frame, m."""
    knuckle_quat: Quaternion
    """Orientation of the knuckle in the palm's frame."""
    anchor: Vector
    """Exit of the actuation cable from the palm, palm's frame, m."""
    p1_side_z: float = 0.0095
    """Height of the side marker of the first pulley, m."""
    g3_z: float = 0.0333
    """Height of the guide before the third pulley, m."""


PLACEMENTS = (
    Placement(
        Channel.INDEX,
        knuckle_pos=(0.031448, -0.004172, 0.10003),
        knuckle_quat=(0.999505, 0.000456857, 0.026173, -0.0174466),
        anchor=(0.031, -0.0170, 0.076),
        g3_z=0.0300,
    ),
    Placement(
        Channel.MIDDLE,
        knuckle_pos=(0.0085, -0.003, 0.10061),
        knuckle_quat=IDENTITY,
        anchor=(0.009, -0.0170, 0.076),
        p1_side_z=0.0125,
    ),
    Placement(
        Channel.RING,
        knuckle_pos=(-0.014448, -0.004172, 0.10003),
        knuckle_quat=(0.999505, 0.000456857, -0.026173, 0.0174466),
        anchor=(-0.014, -0.0170, 0.076),
    ),
    Placement(
        Channel.PINKY,
        knuckle_pos=(-0.036912, -0.0066167, 0.087021),
        knuckle_quat=(0.998019, 0.00182998, -0.0523041, 0.034918),
        anchor=(-0.036, -0.0170, 0.061),
    ),
)


def anchor(place: Placement) -> Guide:
    """Return the start of a finger's actuation cable on the palm."""
    return Guide(f"{place.channel.label}_anchor", place.anchor)


def finger(place: Placement) -> Link:
    """Return a finger of a right hand, with the knuckle as its root."""
    name = place.channel.label
    first = Joint[f"{place.channel.name}_MCP"]

    def pulley(label: str, radius: float, y: float, z: float) -> Pulley:
        return Pulley(f"{name}_{label}", radius, 0.005, "x", (0.0, y, z))

    def guide(label: str, y: float, z: float) -> Guide:
        return Guide(f"{name}_{label}", (0.0, y, z))

    distal = Link(
        name=f"{name}_distal",
        pos=(0.0, 0.00036966, 0.021997),
        quat=(1.0, 0.00052935, 0.0, 0.0),
        inertia=Inertia(
            3.09312e-3,
            (-0.001844, 0.0003583, 0.010728),
            (1.89075e-7, 1.75556e-7, 6.3941e-8),
            (0.696244, -0.184422, 0.050064, 0.691902),
        ),
        hinge=Hinge(Joint(first + 2), X_AXIS, upper=pi / 2, damping=0.05),
        boxes=(Box((0.005, 0.005, 0.010), (0.0, -0.003, 0.014)),),
        pulleys=(pulley("d1", 0.0025, -0.0060, 0.0020), pulley("dip_pulley", 0.0025, 0.0, 0.0)),
        guides=(
            guide("d1_side", -0.0086, 0.0030),
            guide("cable_end", -0.0015, 0.0075),
            guide("c0", 0.0025, 0.0150),
            guide("c1", 0.0025, -0.0020),
            guide("tip", -0.003, 0.023),
        ),
    )
    middle = Link(
        name=f"{name}_middle",
        pos=(0.0, -0.0014554, 0.043),
        quat=(0.999962, 0.00872639, 0.0, 0.0),
        inertia=Inertia(
            2.3759e-3,
            (0.0, -0.00110516, 0.0093962),
            (1.62521e-7, 1.35575e-7, 7.4287e-8),
            (0.70684, -0.01919, 0.01920, 0.70685),
        ),
        hinge=Hinge(Joint(first + 1), X_AXIS, upper=pi / 2, damping=0.05),
        boxes=(Box((0.006, 0.005, 0.010), (0.0, -0.001, 0.006)),),
        guides=(guide("distal_spring_end", 0.0040, 0.0030),),
        links=(distal,),
    )
    proximal = Link(
        name=f"{name}_proximal",
        pos=(0.0, 0.0, 0.0034),
        inertia=Inertia(
            6.00337e-3,
            (0.0, -0.00357858, 0.0205176),
            (8.89988e-7, 8.65278e-7, 2.05352e-7),
            (0.70687, 0.01794, -0.01794, 0.70689),
        ),
        hinge=Hinge(first, X_AXIS, upper=pi / 2, damping=0.1),
        boxes=(Box((0.006, 0.006, 0.013), (0.0, -0.003, 0.019)),),
        pulleys=(
            pulley("p1", 0.0025, -0.0075, 0.0095),
            pulley("p2", 0.0025, -0.0057, 0.0173),
            pulley("p3", 0.0025, -0.0057, 0.0323),
            pulley("pip_pulley", 0.0030, -0.0018, 0.0430),
        ),
        guides=(
            guide("p1_side", -0.0110, place.p1_side_z),
            guide("g1", -0.0063, 0.0135),
            guide("p2_side", -0.0022, 0.0173),
            guide("g3", -0.0025, place.g3_z),
            guide("g4", -0.0025, 0.0333),
            guide("pip_side", -0.0048, 0.0400),
            guide("coupling_end", 0.0012, 0.0350),
            guide("distal_spring_start", 0.0012, 0.0110),
            guide("distal_spring_bend", 0.0012, 0.0400),
            guide("mcp_spring_end", 0.0030, 0.0040),
        ),
        links=(middle,),
    )
    return Link(
        name=f"{name}_knuckle",
        pos=place.knuckle_pos,
        quat=place.knuckle_quat,
        inertia=Inertia(1.697e-4, (0.0, 0.0, 0.0017), (1.290e-9, 1.290e-9, 7.680e-10), IDENTITY),
        pulleys=(pulley("mcp_spring_pulley", 0.0030, 0.0, 0.0029),),
        guides=(guide("mcp_spring_start", 0.0050, 0.0),),
        links=(proximal,),
    )


def cables(place: Placement) -> tuple[Cable, ...]:
    """Return a finger's four paths: actuation cable, PIP-DIP coupling, MCP spring, distal spring."""
    name = place.channel.label

    def path(*stops: str | Around) -> tuple[str | Around, ...]:
        return tuple(f"{name}_{stop}" if isinstance(stop, str) else stop for stop in stops)

    def around(pulley: str, side: str | None = None) -> Around:
        return Around(f"{name}_{pulley}", None if side is None else f"{name}_{side}")

    return (
        Cable(
            f"{name}_cable",
            "actuation",
            path(
                "anchor",
                around("p1", "p1_side"),
                "g1",
                around("p2", "p2_side"),
                "g3",
                around("p3", "g4"),
                "g4",
                around("d1", "d1_side"),
                "cable_end",
            ),
        ),
        Cable(
            f"{name}_coupling",
            "coupling",
            path("c0", around("dip_pulley", "c1"), "c1", around("pip_pulley", "pip_side"), "coupling_end"),
        ),
        Cable(
            f"{name}_mcp_spring",
            "mcp_spring",
            path("mcp_spring_start", around("mcp_spring_pulley"), "mcp_spring_end"),
            MCP_SPRING,
        ),
        Cable(
            f"{name}_distal_spring",
            "distal_spring",
            path("distal_spring_start", "distal_spring_bend", around("pip_pulley"), "distal_spring_end"),
            DISTAL_SPRING,
        ),
    )
