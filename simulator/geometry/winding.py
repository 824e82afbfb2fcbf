"""Spools and winding radii of the mechanism: cable taken up by each joint per radian.

Source: paper, section "The joint-to-actuation model", eqs. (fingermap), (thumbcmc), (thumbflexor), CAD values at the
precision of the released control stack. Abduction drives its joint through a linkage, without a spool.

The actuation map has its own coefficients: a plant that shared them could not reveal an error in the map. A test
compares both.
"""

from aero.channels import FINGERS, Channel, Joint

SPOOL_RADIUS = 9.0e-3
"""Radius of the spools of all six cable channels, m."""
MCP_RADIUS, PIP_RADIUS, DIP_RADIUS = 12.4912e-3, 7.3211e-3, 9.0e-3
"""Winding radii of a finger, m/rad."""
ABDUCTION_RADIUS = 2.5e-3
"""Winding radius of abduction on both thumb cables, m/rad."""

WINDING: dict[Channel, dict[Joint, float]] = {
    **{
        finger: {
            Joint(3 * finger): MCP_RADIUS,
            Joint(3 * finger + 1): PIP_RADIUS,
            Joint(3 * finger + 2): DIP_RADIUS,
        }
        for finger in FINGERS
    },
    Channel.THUMB_CMC_FLEXION: {Joint.THUMB_ABDUCTION: ABDUCTION_RADIUS, Joint.THUMB_CMC: 12.4931e-3},
    Channel.THUMB_FLEXOR: {
        Joint.THUMB_ABDUCTION: ABDUCTION_RADIUS,
        Joint.THUMB_CMC: -2.5e-3,
        Joint.THUMB_MCP: 9.4372e-3,
        Joint.THUMB_IP: 12.5e-3,
    },
}
"""Cable taken up by each joint of each cable channel as it flexes, m/rad; negative pays out."""
