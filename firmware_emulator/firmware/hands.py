"""Servo assignment, and the windows compiled into the firmware for right and left hands.

Source: aero-open-firmware d7bd82e, `HandConfig.h`; unchanged up to v0.2.0.
"""

from dataclasses import dataclass
from typing import Literal

Side = Literal["right", "left"]

SHAFT_OF_SERVO = (4, 5, 6, 0, 1, 2, 3)
"""Shaft (command order) of each servo ID: thumb abduction, CMC flexion, flexor, index, middle, ring, pinky."""
SERVOS = tuple(range(7))

EXTEND_ANGLE_DEG = (0.0, 0.0, -15.2789, 0.0, 0.0, 0.0, 0.0)
"""Shaft angle at the extend end of the window, degrees, by servo ID (aero-open-sdk fed83fe, actuation limits)."""


@dataclass(frozen=True)
class HandConfig:
    """Firmware constants of one side, by servo ID."""

    label: str
    """Name in the boot text."""
    extend: tuple[int, ...]
    """Counts at the open end."""
    grasp: tuple[int, ...]
    """Counts at the closed end."""
    direction: tuple[int, ...]
    """Direction sign, used only by homing and the boot text."""


HANDS: dict[Side, HandConfig] = {
    "right": HandConfig(
        "RIGHT_HAND",
        (2048, 3231, 1115, 3278, 3278, 3278, 3278),
        (910, 2048, 4095, 0, 0, 0, 0),
        (-1, 1, -1, 1, 1, 1, 1),
    ),
    "left": HandConfig(
        "LEFT_HAND",
        (2048, 865, 2980, 817, 817, 817, 817),
        (3186, 2048, 0, 4095, 4095, 4095, 4095),
        (1, -1, 1, -1, -1, -1, -1),
    ),
}
