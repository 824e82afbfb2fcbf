"""Mount and palm, the fixed links, with the cable anchors of the four fingers.

Source: released tendon model `AeroCubeRotateZAxis` (MuJoCo Playground 0.2.0). Palm frame: x from pinky to index,
-y out of the palm, z towards the fingertips; the palm faces up, its fingers 20° below the horizontal.
"""

from simulator.geometry.elements import Box, Guide, Link, Quaternion

_ACROSS: Quaternion = (-0.5, -0.5, -0.5, 0.5)

_MOUNT_BOXES = (
    Box((0.002, 0.025, 0.005), (0.0405, 0.02, 0.009), (0.57346, 0.0, 0.81923, 0.0)),
    Box((0.005, 0.010, 0.005), (0.045, 0.053, 0.002), (0.49872, 0.64994, -0.34910, 0.45496)),
)

_KNUCKLE_GUARDS = tuple(
    Box((0.006, 0.006, 0.006), pos, _ACROSS)
    for pos in (
        (0.031, -0.0045, 0.096),
        (0.009, -0.0045, 0.096),
        (-0.014, -0.0045, 0.096),
        (-0.036, -0.0045, 0.081),
    )
)

_PALM_BOXES = (
    *_KNUCKLE_GUARDS,
    Box((0.029, 0.010, 0.023), (-0.028, -0.0015, 0.034), (0.420605, -0.420605, -0.568411, -0.568411)),
    Box((0.016, 0.044, 0.015), (0.0, 0.007, 0.07), _ACROSS),
    Box((0.0071, 0.042, 0.013), (0.002, -0.014, 0.0745), (0.700443, -0.092458, -0.092458, -0.700443)),
    Box((0.012, 0.042, 0.023), (0.002, -0.0015, 0.052), _ACROSS),
    Box((0.022, 0.020, 0.023), (-0.003, -0.0015, 0.022), _ACROSS),
    Box((0.002, 0.018, 0.017), (0.041, 0.004, 0.002), _ACROSS),
    Box((0.022, 0.028, 0.002), (0.047, 0.02, 0.022), _ACROSS),
)

GRASP_GUIDE = Guide("grasp", (0.11, 0.0, 0.03))
"""Position of a held object, in the mount's frame."""

THENAR_GUIDE = Guide("thenar", (0.0389, -0.0233, 0.0195))
"""Contact of the built hand's metacarpal with the palm in flexion without abduction, in the palm's frame.

Absent from the released model. Position and `THENAR_RADIUS` block CMC flexion at 0.79, 0.79 and 0.78 rad at 0, 25° and
50° of abduction, and leave it free beyond 65°. Source: stops of one physical hand, corrected for the effect of
abduction on its cable (public logs June-July 2026, TTdragoAlex/tetherIA-aero-hand-open 58b518e).
"""
THENAR_RADIUS = 0.0054
"""Radius of the contact at `THENAR_GUIDE`, m."""


def mount(digits: tuple[Link, ...], anchors: tuple[Guide, ...]) -> Link:
    """Return mount and palm of a right hand, with `digits` and the fingers' cable `anchors` on the palm."""
    palm = Link(
        name="palm",
        pos=(0.04, 0.01, -0.015),
        quat=(0.4056, -0.5792, 0.5792, -0.4056),
        boxes=_PALM_BOXES,
        guides=(*anchors, THENAR_GUIDE),
        links=digits,
    )
    return Link(name="mount", pos=(0.0, 0.0, -0.03), boxes=_MOUNT_BOXES, guides=(GRASP_GUIDE,), links=(palm,))
