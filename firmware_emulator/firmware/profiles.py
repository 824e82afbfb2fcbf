"""Differences between the firmware versions, as data.

Sources: aero-open-firmware 46bc858 (`pre`), d7bd82e (0.1.0); aero-hand-open 890c98b (0.1.1), 5726320 (0.1.3), 495c161
(0.1.4), a39be56 (0.1.5), 6a3022d (0.2.0), dd91e5a (`main`); for 0.1.2 the shipped image, as its source was not
published.
"""

from dataclasses import dataclass, replace
from enum import Enum, auto

from firmware_emulator.firmware.frames import Opcode
from firmware_emulator.firmware.homing_plan import (
    HOMING_0_1_0,
    HOMING_0_1_1,
    HOMING_0_1_3,
    HOMING_0_1_5,
    HOMING_0_2_0,
    HOMING_PRE,
    HomingPlan,
)


class BootHoming(Enum):
    """Condition for homing at boot."""

    NEVER = auto()
    """Homing only on request of the host."""
    ALWAYS = auto()
    ON_POWER = auto()
    """Homing after power-on and brown-out; other resets skip it, with a line in the boot text."""


@dataclass(frozen=True)
class FirmwareProfile:
    """One firmware version."""

    version: str
    """Name, for example `0.2.0`; `pre` is the unreleased firmware of the paper's hand (October 2025), `main` the main
    branch since July 2026."""
    opcodes: frozenset[int] = frozenset(Opcode) - {Opcode.CALIBRATE_MID}
    speed: int = 32766
    """Default goal speed, register units."""
    acceleration: int = 0
    """Goal acceleration, register units."""
    torque: int = 1023
    """Default goal torque in position mode, register units."""
    telemetry_period_ms: int = 10
    hot: tuple[int, int] | None = None
    """Threshold of the temperature, °C, and the torque cap at or above it, register units; None for no cap."""
    hand_line: bool = True
    pings: bool = True
    """Whether the boot text reports a ping of each servo."""
    ping_pause_ms: int = 0
    setup_pause_ms: int = 0
    """Pause after the servo UART is opened, ms."""
    direction_lines: bool = True
    """Whether the boot text lists the servo directions."""
    boot_homing: BootHoming = BootHoming.NEVER
    """Condition for homing at boot, as reported in the boot text."""
    homing: HomingPlan = HOMING_0_1_0
    torque_floor: int = 0
    """Smallest magnitude in torque mode, register units."""
    soft_limit: bool = False
    """Whether torque mode reduces the torque of a channel outside its window."""
    sign_of_empty_window: int = 1
    """Sign of the torque for a window of zero width."""
    eeprom_pause_ms: int = 0
    """Pause of SET_ID after writing limit, ID and lock, ms."""
    trim_reads_position: bool = False
    """Whether the acknowledgement of TRIM carries the servo's present position."""


_PRE = FirmwareProfile(
    "pre",
    opcodes=frozenset(Opcode) - {Opcode.CALIBRATE_MID, Opcode.CTRL_TOR, Opcode.SET_SPE, Opcode.SET_TOR},
    speed=2400,
    acceleration=255,
    telemetry_period_ms=20,
    hand_line=False,
    ping_pause_ms=20,
    setup_pause_ms=50,
    direction_lines=False,
    homing=HOMING_PRE,
    eeprom_pause_ms=10,
)
_0_1_0 = FirmwareProfile("0.1.0")
_0_1_1 = replace(_0_1_0, version="0.1.1", homing=HOMING_0_1_1, torque_floor=5, soft_limit=True, sign_of_empty_window=-1)
_0_1_2 = replace(_0_1_1, version="0.1.2", torque=700, hot=(50, 200))
_0_1_3 = replace(_0_1_2, version="0.1.3", homing=HOMING_0_1_3, boot_homing=BootHoming.ALWAYS)
_0_1_4 = replace(_0_1_3, version="0.1.4", hot=(70, 500), boot_homing=BootHoming.ON_POWER)
_0_1_5 = replace(_0_1_4, version="0.1.5", homing=HOMING_0_1_5, pings=False, direction_lines=False)
_0_2_0 = replace(_0_1_5, version="0.2.0", homing=HOMING_0_2_0)
_MAIN = replace(_0_2_0, version="main", opcodes=frozenset(Opcode), trim_reads_position=True)

PROFILES: dict[str, FirmwareProfile] = {
    profile.version: profile for profile in (_PRE, _0_1_0, _0_1_1, _0_1_2, _0_1_3, _0_1_4, _0_1_5, _0_2_0, _MAIN)
}
DEFAULT_VERSION = _0_2_0.version
"""The newest release."""


def profile_of(version: str) -> FirmwareProfile:
    """Return the profile of a firmware version.

    Raises:
        ValueError: no such version.
    """
    if version not in PROFILES:
        raise ValueError(f"unknown firmware {version!r}; known are {', '.join(PROFILES)}")
    return PROFILES[version]
