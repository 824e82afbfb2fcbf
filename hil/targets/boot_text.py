"""What a board's boot text says about it: version, hand side, and servos that did not answer.

No version can report itself; the lines that it prints when it starts are all there is. Source: `aero-open-firmware`
d7bd82e and the published images 0.1.0 to 0.2.0.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from aero.firmware import FIRMWARE, BootText

PINGS = "Pinging servos"
"""Printed before each servo is asked, by every version up to 0.1.4."""
RESET_CAUSE = ("Power-on detected", "Non-power reset")
"""Printed from 0.1.4 on."""
AUTO_HOMING = "Auto Homing"
"""Printed by 0.1.3 alone."""


@dataclass(frozen=True)
class Identity:
    """What a boot text gives away."""

    versions: tuple[str, ...]
    """Firmware versions that print such a text; empty for a text of something else."""
    side: str | None
    """`right` or `left`; None where the version does not say."""
    silent: tuple[int, ...]
    """Bus IDs of the servos that did not answer."""

    def describe(self) -> str:
        """Say in one line what it is."""
        versions = " or ".join(self.versions) or "an unknown version"
        silent = f", no answer from servo {', '.join(map(str, self.silent))}" if self.silent else ""
        return f"boot text of firmware {versions}, {self.side or 'unknown'} hand{silent}"


def identify(text: str) -> Identity:
    """Read a boot text, or the part of one that was caught."""
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
