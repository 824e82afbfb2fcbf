"""The limits that each firmware starts with. A guard gives them back after its slow opening.

Sources: aero-open-firmware 46bc858 (`pre`), d7bd82e (0.1.0); aero-hand-open 890c98b (0.1.1), 5726320 (0.1.3), 495c161
(0.1.4), a39be56 (0.1.5), 6a3022d (0.2.0), dd91e5a (`main`); the shipped image of 0.1.2.
"""

from __future__ import annotations

from aero.safety.thresholds import ServoSettings

_FULL, _WEAKER = ServoSettings(32766, 1023), ServoSettings(32766, 700)
USUAL: dict[str, ServoSettings | None] = {
    "pre": None,
    "0.1.0": _FULL,
    "0.1.1": _FULL,
    "0.1.2": _WEAKER,
    "0.1.3": _WEAKER,
    "0.1.4": _WEAKER,
    "0.1.5": _WEAKER,
    "0.2.0": _WEAKER,
    "main": _WEAKER,
}
"""By version; None where the firmware has no settings for them."""


def usual_settings(firmware: str) -> ServoSettings | None:
    """Return the limits a firmware starts with; None when it has no way to set them.

    Raises:
        ValueError: an unknown firmware.
    """
    if firmware not in USUAL:
        raise ValueError(f"unknown firmware {firmware!r}; known are {', '.join(USUAL)}")
    return USUAL[firmware]
