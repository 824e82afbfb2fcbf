"""Seven channels, sixteen joints, and the three channel orders: command, wire and observation.

Every array over channels in this project is in **command order**, the order of `Channel`. Only the packing of host
frames uses the wire order, and only a policy's observation uses the observation order. Mixed-up orders are the most
frequent mistake reported by users of this hand.

Sources: paper section "Notation" (command order, joint box), `aero-open-firmware` d7bd82e (wire order = servo ID),
the released tendon model `AeroCubeRotateZAxis` (observation order).
"""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Channel(IntEnum):
    """Actuated channel; its value is the index into every channel array (command order)."""

    INDEX = 0
    MIDDLE = 1
    RING = 2
    PINKY = 3
    THUMB_ABDUCTION = 4
    THUMB_CMC_FLEXION = 5
    THUMB_FLEXOR = 6

    @property
    def label(self) -> str:
        """Lower-case name used in files and on the command line, for example `thumb_cmc_flexion`."""
        return self.name.lower()

    @property
    def title(self) -> str:
        """Display name, for example `Thumb CMC flexion`."""
        return self.label.replace("_", " ").capitalize().replace("cmc", "CMC")


FINGERS = (Channel.INDEX, Channel.MIDDLE, Channel.RING, Channel.PINKY)
THUMB = (Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
CABLES = (*FINGERS, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)

WIRE_ORDER = (
    Channel.THUMB_ABDUCTION,
    Channel.THUMB_CMC_FLEXION,
    Channel.THUMB_FLEXOR,
    Channel.INDEX,
    Channel.MIDDLE,
    Channel.RING,
    Channel.PINKY,
)
"""Channel carried by each word of a host frame; the position is also the servo's bus ID."""

OBSERVATION_ORDER = (
    Channel.INDEX,
    Channel.MIDDLE,
    Channel.RING,
    Channel.PINKY,
    Channel.THUMB_CMC_FLEXION,
    Channel.THUMB_FLEXOR,
    Channel.THUMB_ABDUCTION,
)
"""Channel at each position of a policy's observation: the sensor order of the released model."""


class Joint(IntEnum):
    """Joint; fingers first, each from the palm outwards, then the thumb."""

    INDEX_MCP = 0
    INDEX_PIP = 1
    INDEX_DIP = 2
    MIDDLE_MCP = 3
    MIDDLE_PIP = 4
    MIDDLE_DIP = 5
    RING_MCP = 6
    RING_PIP = 7
    RING_DIP = 8
    PINKY_MCP = 9
    PINKY_PIP = 10
    PINKY_DIP = 11
    THUMB_ABDUCTION = 12
    THUMB_CMC = 13
    THUMB_MCP = 14
    THUMB_IP = 15

    @property
    def label(self) -> str:
        """Lower-case name used in files and on the command line, for example `index_mcp`."""
        return self.name.lower()


def _joint_box_rad() -> NDArray[np.float64]:
    box_deg: NDArray[np.float64] = np.tile([0.0, 90.0], (len(Joint), 1))
    box_deg[Joint.THUMB_ABDUCTION] = 0.0, 100.0
    box_deg[Joint.THUMB_CMC] = 0.0, 55.0
    box_rad: NDArray[np.float64] = np.deg2rad(box_deg)
    box_rad.flags.writeable = False
    return box_rad


JOINT_BOX_RAD = _joint_box_rad()
"""Admissible joint angles, (16, 2) float, rad; paper, after eq. (actrange)."""
