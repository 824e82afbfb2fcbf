"""What driver, guard, doctor and limits must know of each firmware version: one row each.

A new version is a row here and one in `firmware_emulator/firmware/profiles.py`, which the emulated board is made from.
The two share nothing, so that a misread fact makes them disagree.

Sources: aero-open-firmware 46bc858 (`pre`), d7bd82e (0.1.0); aero-hand-open 890c98b (0.1.1), 5726320 (0.1.3), 495c161
(0.1.4), a39be56 (0.1.5), 6a3022d (0.2.0), dd91e5a (`main`, the main branch since July 2026); the shipped image of
0.1.2, for which no source was published.
"""

from __future__ import annotations

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
    """What a board prints when it starts, as far as versions differ."""

    PINGS = auto()
    """It asks each servo, and does not name the hand."""
    HAND_AND_PINGS = auto()
    """It names the hand and asks each servo."""
    AUTO_HOMING = auto()
    """It says that it homes by itself."""
    RESET_AND_PINGS = auto()
    """It says why it started, and asks each servo."""
    RESET = auto()
    """It says why it started."""


@dataclass(frozen=True)
class Firmware:
    """One version."""

    version: str
    """Name, for example `0.2.0`; `pre` is the unreleased one of October 2025 that the paper's hand ran."""
    moves_as: str
    """Oldest version with the same motion profile, torque, homing and windows: hands of both have the same limits."""
    boot_text: BootText
    settings: ServoSettings | None = None
    """Limits that it starts with, which a guard restores after its slow opening; None where it cannot set any."""
    calibration_states: tuple[str, ...] = ("unshifted",)
    """States of its command windows, the typical one first; see `aero.actuation.CommandWindow`."""
    calibrate_mid: bool = False
    """Whether it knows CALIBRATE_MID."""
    homing_s: float = 4.0
    """Time that a healthy hand takes to home, s."""


LONGEST_BOOT_S = 50.0
"""Time after power returned in which a board answers that homes by itself and finds nothing, s."""


FULL, WEAKER = ServoSettings(32766, 1023), ServoSettings(32766, 700)
THUMB_STATES = ("homed", "unshifted", "mixed")
"""Calibration states of a version whose homing shifts windows of the thumb."""
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
"""Every version, oldest first."""
DEFAULT_FIRMWARE = "0.2.0"
"""Taken for what a hand runs when nothing is said: the newest release."""
VERSION_GROUPS = tuple(tuple(row.version for row in rows) for _, rows in groupby(_ROWS, key=lambda row: row.moves_as))
"""Versions in groups that move alike."""


def firmware_of(version: str) -> Firmware:
    """Return the row of a version.

    Raises:
        ValueError: no such version.
    """
    if version not in FIRMWARE:
        raise ValueError(f"unknown firmware {version!r}; known are {', '.join(FIRMWARE)}")
    return FIRMWARE[version]
