"""When a hand is stopped, and how gently it is moved around that: every threshold of the project's safety, once."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from aero.protocol import MAX_SPEED_SETTING, MAX_TORQUE_SETTING

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
nominal scale and cuts out at 80 °C; shares are of the window; speeds and torques are registers of the board."""
_THOUSANDTH = {"a": "mA", "s": "ms"}
"""Unit that a value is in by mistake, by the end of its threshold's name."""


@dataclass(frozen=True)
class Thresholds:
    """What a hand must not exceed while a program moves it; the defaults hold for every firmware.

    "The logs" are those of one physical right hand, June-July 2026 (TTdragoAlex/tetherIA-aero-hand-open 58b518e).

    Raises:
        ValueError: a threshold is not positive and finite, or above its bound; or a setting is not a whole number.
    """

    current_a: float = 4.0
    """Motor current of one channel, A; 88 % of what the default torque limit allows, 3.0-3.4 A at end stops (logs)."""
    current_s: float = 0.3
    """How long a channel may draw more than that, s; a free start of motion is over in 0.1 s."""
    temperature_c: float = 65.0
    """Temperature of one servo, °C; the logs reach 58, firmware 0.1.4 and later weakens its servos from 70."""
    stale_s: float = 0.2
    """How long readings may be the same to the last digit, s, which live currents never are."""
    silent_s: float = 1.0
    """How long the board may leave readings unanswered, s; a busy machine is late by 0.9 s now and then."""
    short: float = 0.5
    """How far an encoder may stand on the open side of what was commanded, fraction of the window; the palm holds a
    healthy CMC flexion 0.40 short (logs)."""
    beyond: float = 0.15
    """How far an encoder may stand on the closed side of what was commanded, fraction of the window."""
    follow_s: float = 2.0
    """Commands no older than this say where an encoder may be, s; the slowest firmware, `pre`, closes in 1.5 s."""
    stray_s: float = 0.1
    """How long an encoder may be out of its range, s: longer than one bad reading."""
    rest: float = 0.1
    """How far an encoder may move while no channel has been commanded anything new for `follow_s`, share of the
    window: a tenth of a finger's window takes the whole torque of its servo."""
    jump_counts_s: float = 13000.0
    """Speed that an encoder may show, servo counts/s: half as much again as a servo without load (8100-8800, logs)."""
    arrival: float = 0.1
    """How far from open an encoder may be after the slow opening at the start, fraction of the window."""
    look_s: float = 0.04
    """Time from one poll of currents and encoders to the next, s; several polls fit into the shortest patience."""
    temperature_look_s: float = 1.0
    """Time from one poll of the temperatures to the next, s; they rise by 0.13 °C/s at most (logs)."""
    opening_s: float = 2.0
    """How long the hand is given to open, at the start and at the end, s."""
    opening_patience_s: float = 10.0
    """How long a hand that does not open is tried again, s: a board that starts homes for 4 s first."""
    unwatched_s: float = 10.0
    """How long a hand that is not open may go without a poll, s, before it is opened: this machine was suspended, or
    its program was stopped."""
    gentle_speed: int = 40
    """Speed limit while it opens, register units of 0.732 rpm: a finger's whole window in 1.6 s."""
    gentle_torque: int = 300
    """Torque limit while it opens, register units: 1.95 A at the nominal scale."""
    stop_torque: int = 500
    """Torque limit of channels that meet a stop, register units, 3.25 A: the thumb's always, others where a program
    says so. The palm stops a healthy CMC flexion at 0.61 of its window, the flexor stops at 0.83 and the fingers at
    0.98 (logs), where the default limit lets up to 4.5 A flow."""
    limp_torque: int = 200
    """Torque limit it is left with, register units: what firmware 0.1.2 leaves to hot servos, 1.3 A."""

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

    def as_dict(self) -> dict[str, float]:
        """Return every threshold by name, for the header of a recording and for people."""
        return dataclasses.asdict(self)
