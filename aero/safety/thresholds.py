"""Safety thresholds of a guarded hand: stop criteria, and limits of its slow motions."""

import math
from dataclasses import dataclass

from aero.protocol import MAX_SPEED_SETTING, MAX_TORQUE_SETTING
from aero.safety.regions import Region

_MOST = {
    "current_a": 7.0,
    "current_s": 5.0,
    "temperature_c": 80.0,
    "stale_s": 10.0,
    "silent_s": 10.0,
    "short": 1.0,
    "beyond": 1.0,
    "follow_s": 10.0,
    "stray_s": 5.0,
    "rest": 1.0,
    "jump_counts_s": 100_000.0,
    "arrival": 0.5,
    "look_s": 0.5,
    "temperature_look_s": 30.0,
    "opening_s": 30.0,
    "opening_patience_s": 120.0,
    "unwatched_s": 120.0,
    "gentle_speed": MAX_SPEED_SETTING,
    "gentle_torque": MAX_TORQUE_SETTING,
    "stop_torque": MAX_TORQUE_SETTING,
    "limp_torque": MAX_TORQUE_SETTING,
}
"""Upper bound of each threshold, in its unit; above it the guard would not protect. A servo draws at most 6.65 A at the
nominal scale and cuts out at 80 °C; fractions are of the window; speeds and torques are in register units."""
_THOUSANDTH = {"a": "mA", "s": "ms"}
"""Likely mistaken unit by suffix of the threshold's name, for messages."""


@dataclass(frozen=True)
class Thresholds:
    """Thresholds of a guarded hand; the defaults suit every firmware.

    "The logs" are those of one physical right hand, June-July 2026 (TTdragoAlex/tetherIA-aero-hand-open 58b518e).

    Raises:
        ValueError: a threshold not positive and finite, or above its bound, or a register setting not an integer, or
            regions in another form than a tuple of `Region`.
    """

    current_a: float = 4.0
    """Threshold of a channel's current, A; above it for `current_s` the hand is stopped. The default torque limit
    allows 4.5 A, and 3.0-3.4 A flow at end stops (logs)."""
    current_s: float = 0.3
    """Threshold of the duration of an over-current, s; the start of a free motion lasts 0.1 s."""
    temperature_c: float = 65.0
    """Threshold of a servo's temperature, °C. The logs reach 58; firmware 0.1.4 and later reduces torque from 70."""
    stale_s: float = 0.2
    """Threshold of the duration of identical readings, s; live currents always differ."""
    silent_s: float = 1.0
    """Threshold of the time without a reply, s; a busy computer can be 0.9 s late."""
    short: float = 0.5
    """Threshold of an encoder's deviation to the open side, fraction of the window. The palm stops a healthy CMC
    flexion 0.40 short of its command (logs)."""
    beyond: float = 0.15
    """Threshold of an encoder's deviation to the closed side, fraction of the window."""
    follow_s: float = 2.0
    """Age limit of commands with which encoders are compared, s; the slowest firmware, `pre`, closes in 1.5 s."""
    stray_s: float = 0.1
    """Threshold of the duration of an encoder's deviation, s; longer than a single bad reading."""
    rest: float = 0.1
    """Threshold of an encoder's motion without a new command for `follow_s`, fraction of the window. Moving a finger by
    this much takes the full torque of its servo."""
    jump_counts_s: float = 13000.0
    """Threshold of an encoder's speed, servo counts/s: 1.5 times the no-load speed (8100-8800, logs)."""
    arrival: float = 0.1
    """Threshold of an encoder's distance from open after a slow opening, fraction of the window."""
    look_s: float = 0.04
    """Poll period of currents and encoders, s; a fraction of the shortest duration threshold."""
    temperature_look_s: float = 1.0
    """Poll period of temperatures, s; they rise by at most 0.13 °C/s (logs)."""
    opening_s: float = 2.0
    """Duration of a slow opening, at the start and at the end, s."""
    opening_patience_s: float = 10.0
    """Time-out of retries for a hand that does not open, s; a starting board homes for 4 s first."""
    unwatched_s: float = 10.0
    """Threshold of the time without a poll of a closed hand, s; above it the hand is opened. Causes: a suspended
    computer or a stopped program."""
    gentle_speed: int = 40
    """Speed limit in a slow opening, register units of 0.732 rpm; a finger's whole window takes 1.6 s."""
    gentle_torque: int = 300
    """Torque limit in a slow opening, register units: 1.95 A at the nominal scale."""
    stop_torque: int = 500
    """Torque limit at end stops, register units (3.25 A): always for the thumb, for other channels on request. The palm
    stops a healthy CMC flexion at 0.61 of its window, the flexor stops at 0.83 and the fingers at 0.98 (logs); the
    default limit allows up to 4.5 A there."""
    limp_torque: int = 200
    """Torque limit after the final opening, register units (1.3 A): firmware 0.1.2's limit for hot servos."""
    forbidden: tuple[Region, ...] = ()
    """Regions that no command enters, and around which the hand opens."""

    def __post_init__(self) -> None:
        for name, value in self.as_dict().items():
            if (
                isinstance(value, bool)
                or not isinstance(value, (int, float))
                or not (math.isfinite(value) and value > 0)
            ):
                raise ValueError(f"safety threshold {name}: expected a positive number, got {value!r}")
            most = _MOST[name]
            if isinstance(most, int) and not isinstance(value, int):
                raise ValueError(f"safety threshold {name}: the board stores whole numbers, got {value!r}")
            if value > most:
                unit = _THOUSANDTH.get(name.rsplit("_", 1)[-1])
                meant = f"; {unit}?" if unit and value <= 1000 * most else ""
                raise ValueError(f"safety threshold {name}: expected at most {most:g}, got {value!r}{meant}")
        if not (isinstance(self.forbidden, tuple) and all(isinstance(one, Region) for one in self.forbidden)):
            raise ValueError(f"safety threshold forbidden: expected a tuple of regions, got {self.forbidden!r}")

    def as_dict(self) -> dict[str, float]:
        """Return the thresholds by name, without regions, for recordings and messages."""
        return {name: value for name, value in vars(self).items() if name != "forbidden"}
