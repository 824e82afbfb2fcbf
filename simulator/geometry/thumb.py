"""Geometry of the thumb: four links, two cables over a cluster of pulleys on the abduction axis, two springs.

Source: released tendon model `AeroCubeRotateZAxis` (MuJoCo Playground 0.2.0); springs also in the paper, section
"Cable transmission as spatial tendons". A pulley on the metacarpal that carries no cable is omitted.
"""

from math import pi, radians

from aero.channels import Joint
from simulator.geometry.elements import Around, Box, Cable, Guide, Hinge, Inertia, Link, Pulley, Spring, Vector
from simulator.geometry.finger import DISTAL_SPRING, X_AXIS

Y_AXIS: Vector = (0.0, 1.0, 0.0)
DAMPING = 0.02
CMC_SPRING = Spring(stiffness=1897.0, rest_length=0.013)
CMC_UPPER = 0.9559
"""Closed stop of CMC flexion in the released model, rad; the joint box of the paper has 55° = 0.9599 rad."""


def _guide(label: str, *pos: float) -> Guide:
    x, y, z = pos
    return Guide(f"thumb_{label}", (x, y, z))


_DISTAL = Link(
    name="thumb_distal",
    pos=(0.0, 0.00052357, 0.029995),
    inertia=Inertia(
        6.92863e-3,
        (-0.00113926, -0.00130909, 0.0133464),
        (6.65186e-7, 5.66522e-7, 2.78338e-7),
        (0.698666, -0.140008, 0.0513212, 0.699736),
    ),
    hinge=Hinge(Joint.THUMB_IP, X_AXIS, upper=pi / 2, damping=DAMPING),
    boxes=(Box((0.008, 0.006, 0.012), (0.0, -0.002, 0.015)),),
    pulleys=(Pulley("thumb_ip_pulley", 0.0025, 0.005, "x", (0.0, -0.008, 0.002)),),
    guides=(
        _guide("ip_side", 0.0, -0.0106, 0.002),
        _guide("flexor_end", 0.0, -0.0003, 0.0115),
        _guide("tip", 0.0, -0.005, 0.027),
    ),
)
_PROXIMAL = Link(
    name="thumb_proximal",
    pos=(0.0, 0.0013652, 0.035982),
    inertia=Inertia(
        5.74573e-3,
        (0.0, -0.00147723, 0.0133935),
        (6.77924e-7, 5.00351e-7, 3.51862e-7),
        (0.707028, -0.010773, 0.0107885, 0.707021),
    ),
    hinge=Hinge(Joint.THUMB_MCP, X_AXIS, upper=pi / 2, damping=DAMPING),
    boxes=(Box((0.008, 0.006, 0.012), (0.0, -0.002, 0.012)),),
    pulleys=(Pulley("thumb_mcp_spring_pulley", 0.0045, 0.005, "x", (0.0, 0.0, 0.0)),),
    guides=(_guide("distal_spring_bend", 0.0, 0.005, -0.0015), _guide("distal_spring_end", 0.0, 0.005, 0.006)),
    links=(_DISTAL,),
)
_METACARPAL = Link(
    name="thumb_metacarpal",
    pos=(-0.0024625, 0.011988, 0.019805),
    quat=(0.988119, 0.0527639, -0.058289, 0.132056),
    inertia=Inertia(
        1.02694e-2,
        (0.0, -0.0014303, 0.0147562),
        (1.58158e-6, 1.39018e-6, 6.7267e-7),
        (0.706814, 0.0205256, -0.020536, 0.706804),
    ),
    hinge=Hinge(Joint.THUMB_CMC, X_AXIS, upper=CMC_UPPER, damping=DAMPING),
    boxes=(Box((0.008, 0.010, 0.016), (0.0, 0.0, 0.014)),),
    guides=(
        _guide("cmc_end", 0.0, -0.012, 0.015),
        _guide("flexor_bend", 0.0, -0.002, 0.028),
        _guide("cmc_spring_end", 0.0, 0.011, 0.0045),
        _guide("distal_spring_start", 0.0, 0.004, 0.009),
    ),
    links=(_PROXIMAL,),
)
DIGIT = Link(
    name="thumb_base",
    pos=(0.026317, -0.0175, 0.02956),
    quat=(0.579233, -0.40557, 0.405572, -0.579235),
    inertia=Inertia(
        8.93482e-3,
        (-0.000792597, 0.00920489, 0.00837042),
        (1.11708e-6, 8.42419e-7, 4.36164e-7),
        (0.968785, -0.231969, -0.0564922, 0.066746),
    ),
    hinge=Hinge(Joint.THUMB_ABDUCTION, Y_AXIS, upper=radians(100.0), damping=DAMPING),
    boxes=(Box((0.015, 0.008, 0.008), (-0.01, 0.015, 0.005)),),
    pulleys=(
        Pulley("thumb_a1", 0.0025, 0.0012, "y", (0.0, 0.0018, 0.0)),
        Pulley("thumb_a2", 0.0025, 0.0012, "y", (0.0037, 0.0018, 0.0055)),
        Pulley("thumb_a3", 0.0017, 0.0015, "x", (0.001, 0.0004, 0.0108)),
        Pulley("thumb_b1", 0.0025, 0.0012, "y", (0.0, 0.0145, 0.0)),
        Pulley("thumb_b2", 0.0025, 0.0012, "y", (0.0017, 0.0145, 0.0069)),
        Pulley("thumb_b3", 0.0025, 0.0025, "x", (0.0017, 0.0135, 0.0203)),
    ),
    guides=(
        _guide("cmc_start", 0.0, 0.0018, -0.0030),
        _guide("cmc_1", 0.00185, 0.0018, 0.00275),
        _guide("cmc_2", 0.00185, 0.0018, 0.0083),
        _guide("cmc_3", 0.00185, 0.0018, 0.0125),
        _guide("flexor_start", 0.0, 0.0145, -0.0030),
        _guide("flexor_1", 0.00085, 0.0145, 0.00345),
        _guide("flexor_2", 0.00035, 0.0145, 0.0110),
        _guide("flexor_3", 0.0017, 0.0165, 0.0203),
        _guide("cmc_spring_start", -0.0038, 0.021, 0.0125),
    ),
    links=(_METACARPAL,),
)

CABLES = (
    Cable(
        "thumb_cmc_cable",
        "actuation",
        (
            "thumb_cmc_start",
            Around("thumb_a1"),
            "thumb_cmc_1",
            Around("thumb_a2"),
            "thumb_cmc_2",
            Around("thumb_a3"),
            "thumb_cmc_3",
            "thumb_cmc_end",
        ),
    ),
    Cable(
        "thumb_flexor_cable",
        "actuation",
        (
            "thumb_flexor_start",
            Around("thumb_b1"),
            "thumb_flexor_1",
            Around("thumb_b2"),
            "thumb_flexor_2",
            Around("thumb_b3"),
            "thumb_flexor_3",
            Around("thumb_b3", "thumb_flexor_3"),
            "thumb_flexor_bend",
            Around("thumb_ip_pulley", "thumb_ip_side"),
            "thumb_flexor_end",
        ),
    ),
    Cable("thumb_cmc_spring", "cmc_spring", ("thumb_cmc_spring_start", "thumb_cmc_spring_end"), CMC_SPRING),
    Cable(
        "thumb_distal_spring",
        "distal_spring",
        (
            "thumb_distal_spring_start",
            Around("thumb_mcp_spring_pulley"),
            "thumb_distal_spring_bend",
            Around("thumb_mcp_spring_pulley"),
            "thumb_distal_spring_end",
        ),
        DISTAL_SPRING,
    ),
)
