"""Identification of a board by its boot text: version, hand side, and silent servos.

Firmware cannot report its version; the boot text is the only evidence. Source: `aero-open-firmware` d7bd82e and the
published images 0.1.0 to 0.2.0.
"""

import re
from dataclasses import dataclass

from aero.firmware import FIRMWARE, BootText

PINGS = "Pinging servos"
"""Line before the pings of the servos; versions up to 0.1.4."""
RESET_CAUSE = ("Power-on detected", "Non-power reset")
"""Lines with the cause of a reset; version 0.1.4 and later."""
AUTO_HOMING = "Auto Homing"
"""Line of version 0.1.3 only."""


@dataclass(frozen=True)
class Identity:
    """Findings from a boot text."""

    versions: tuple[str, ...]
    """Firmware versions with such a boot text; empty for an unknown text."""
    side: str | None
    """`right` or `left`; None if the text does not name the side."""
    silent: tuple[int, ...]
    """Bus IDs of the silent servos."""

    def describe(self) -> str:
        """Return one line with version, side and silent servos."""
        versions = " or ".join(self.versions) or "an unknown version"
        silent = f", no answer from servo {', '.join(map(str, self.silent))}" if self.silent else ""
        return f"boot text of firmware {versions}, {self.side or 'unknown'} hand{silent}"


def identify(text: str) -> Identity:
    """Identify a board by its boot text or a part of it."""
    side = re.search(r"Hand Type: (RIGHT|LEFT)_HAND", text)
    silent = tuple(int(servo) for servo in re.findall(r"ID (\d): NO REPLY", text))
    return Identity(_versions(text, has_side=side is not None), side.group(1).lower() if side else None, silent)


def _versions(text: str, *, has_side: bool) -> tuple[str, ...]:
    kind = None
    if AUTO_HOMING in text:
        kind = BootText.AUTO_HOMING
    elif any(cause in text for cause in RESET_CAUSE):
        kind = BootText.RESET_AND_PINGS if PINGS in text else BootText.RESET
    elif PINGS in text:
        kind = BootText.HAND_AND_PINGS if has_side else BootText.PINGS
    return tuple(row.version for row in FIRMWARE.values() if row.boot_text is kind)
