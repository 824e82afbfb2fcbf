"""Firmware table for driver, guard, doctor and limits: one row a version.

A new version needs a row here and one in `firmware_emulator/firmware/profiles.py`, the source of the emulated board.
The tables share no code, so that a misread fact shows as a disagreement.

Sources: aero-open-firmware 46bc858 (`pre`), d7bd82e (0.1.0); aero-hand-open 890c98b (0.1.1), 5726320 (0.1.3), 495c161
(0.1.4), a39be56 (0.1.5), 6a3022d (0.2.0), dd91e5a (`main`, the main branch since July 2026); the shipped image of
0.1.2, for which no source was published.
"""

from dataclasses import dataclass
from enum import Enum, auto
from itertools import groupby


@dataclass(frozen=True)
class ServoSettings:
    """Speed and torque limits of all channels."""

    speed: int
    """Register units, 0..32766."""
    torque: int
    """Register units, 0..1023."""


class BootText(Enum):
    """Content of the boot text, where versions differ."""

    PINGS = auto()
    """Ping result of each servo, without the hand's side."""
    HAND_AND_PINGS = auto()
    AUTO_HOMING = auto()
    RESET_AND_PINGS = auto()
    RESET = auto()
    """Reset reason."""


@dataclass(frozen=True)
class Firmware:
    """Properties of one firmware version."""

    version: str
    """Name, for example `0.2.0`; `pre` is the unreleased version of October 2025 on the paper's hand."""
    moves_as: str
    """Oldest version with equal motion profile, torque, homing and windows; it has equal check limits."""
    boot_text: BootText
    settings: ServoSettings | None = None
    """Servo limits at start, restored by a guard after its slow opening; None without such settings."""
    calibration_states: tuple[str, ...] = ("unshifted",)
    """Possible states of the command windows, the typical one first; see `aero.actuation.CommandWindow`."""
    calibrate_mid: bool = False
    homing_s: float = 4.0
    """Homing time of a healthy hand, s."""


LONGEST_BOOT_S = 50.0
"""Longest time from power-on to the first reply, s: automatic homing with every search timing out."""


FULL, WEAKER = ServoSettings(32766, 1023), ServoSettings(32766, 700)
THUMB_STATES = ("homed", "unshifted", "mixed")
"""Calibration states of a version with thumb windows shifted by homing."""
_ROWS = (
    Firmware("pre", "pre", BootText.PINGS, homing_s=59.0),
    Firmware("0.1.0", "0.1.0", BootText.HAND_AND_PINGS, FULL, homing_s=57.0),
    Firmware("0.1.1", "0.1.0", BootText.HAND_AND_PINGS, FULL, homing_s=57.0),
    Firmware("0.1.2", "0.1.2", BootText.HAND_AND_PINGS, WEAKER, homing_s=57.0),
    Firmware("0.1.3", "0.1.3", BootText.AUTO_HOMING, WEAKER),
    Firmware("0.1.4", "0.1.3", BootText.RESET_AND_PINGS, WEAKER),
    Firmware("0.1.5", "0.1.3", BootText.RESET, WEAKER),
    Firmware("0.2.0", "0.2.0", BootText.RESET, WEAKER, THUMB_STATES),
    Firmware("main", "0.2.0", BootText.RESET, WEAKER, THUMB_STATES, calibrate_mid=True),
)
FIRMWARE: dict[str, Firmware] = {row.version: row for row in _ROWS}
"""Rows by version, oldest first."""
DEFAULT_FIRMWARE = "0.2.0"
"""Assumed version of a hand if the user names none: the newest release."""
VERSION_GROUPS = tuple(tuple(row.version for row in rows) for _, rows in groupby(_ROWS, key=lambda row: row.moves_as))
"""Groups of versions with equal motion."""


def firmware_of(version: str) -> Firmware:
    """Return the row of a version.

    Raises:
        ValueError: unknown version.
    """
    if version not in FIRMWARE:
        raise ValueError(f"unknown firmware {version!r}; known are {', '.join(FIRMWARE)}")
    return FIRMWARE[version]
