"""Initial conditions of a healthy hand: orientation, temperature, supply, host jitter, board limits, pretension.

Conditions are not faults: `Conditions` describes one hand, `RANGES` the variation and its reasons, and `drawn` draws
conditions at random. A validation must hold under all of them.
"""

import dataclasses
import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any
from zlib import crc32

import numpy as np

from aero.channels import Channel
from model.units import Unit


@dataclass(frozen=True)
class Conditions:
    """Initial conditions of one hand; the defaults are neutral."""

    tilt_rad: float = 0.0
    """Tilt from palm up, rad; pi is palm down."""
    heading_rad: float = 0.0
    """Direction of the tilt about the normal of the palm, rad."""
    room_c: float | None = None
    """Room temperature, °C; None keeps the unit's temperatures."""
    work: float = 0.0
    """Warming of the servos by earlier work, 0 (room temperature) to 1; only with `room_c`."""
    supply_ratio: float | None = None
    """Supply voltage over nominal; None for the unit's own."""
    late_s: float = 0.0
    """Largest delay of a write by the host, s; each delay is between half of this value and this value."""
    torque: int | None = None
    """Torque limit set on all channels by an earlier program, register units; None for the firmware's."""
    speed: int | None = None
    """Speed limit set on all channels by an earlier program, register units; None for the firmware's."""

    pretension_m: tuple[float, ...] = (0.0,) * len(Channel)
    """Shortening of each cable against the unit's, m; (7,) in command order."""

    @property
    def down(self) -> tuple[float, float, float]:
        """Direction of gravity in the hand's frame, unit vector."""
        side = math.sin(self.tilt_rad)
        return (side * math.cos(self.heading_rad), side * math.sin(self.heading_rad), -math.cos(self.tilt_rad))

    def applied(self, unit: Unit) -> Unit:
        """Return the unit under these conditions, without the host's delays and the board's limits."""
        mechanics, servos = unit.hand, unit.servos
        if self.tilt_rad:
            mechanics = dataclasses.replace(mechanics, down=self.down)
        if self.room_c is not None:
            rest = self.room_c + IDLE_RISE_C
            start = self.room_c + self.work * WORK_RISE_C
            warmer = (start + rest) / 2 - (servos.start_temperature_c + servos.rest_temperature_c) / 2
            servos = dataclasses.replace(
                servos,
                rest_temperature_c=rest,
                start_temperature_c=start,
                stall_torque=servos.stall_torque / (1.0 + COPPER_PER_K * warmer),
            )
            friction = tuple(value * math.exp(-GREASE_PER_K * warmer) for value in mechanics.spool_friction)
            mechanics = dataclasses.replace(mechanics, spool_friction=friction)
        if self.supply_ratio is not None:
            mechanics = dataclasses.replace(mechanics, supply_ratio=self.supply_ratio)
            servos = dataclasses.replace(servos, voltage=NOMINAL_V * self.supply_ratio)
        if any(self.pretension_m):
            take_up = zip(mechanics.cable_take_up, self.pretension_m, strict=True)
            mechanics = dataclasses.replace(
                mechanics, cable_take_up=tuple(length - tighter for length, tighter in take_up)
            )
        return dataclasses.replace(unit, hand=mechanics, servos=servos)


@dataclass(frozen=True)
class Spread:
    """Range of one field of `Conditions`, with its reason."""

    kind: str
    """Kind of condition; all fields of a kind are drawn together."""
    name: str
    low: float
    high: float
    reason: str
    logarithmic: bool = False
    whole: bool = False
    each: bool = False
    """True to draw one value a channel."""

    def draw(self, random: np.random.Generator) -> float | tuple[float, ...]:
        """Draw uniformly, or log-uniformly if `logarithmic`."""
        if self.each:
            return tuple(random.uniform(self.low, self.high, len(Channel)).tolist())
        if self.logarithmic:
            value = float(np.exp(random.uniform(math.log(self.low), math.log(self.high))))
        else:
            value = float(random.uniform(self.low, self.high))
        return round(value) if self.whole else value


RANGES = (
    Spread("gravity", "tilt_rad", 0.0, math.pi, "on its back on a bench, on an arm in any position, palm down"),
    Spread("gravity", "heading_rad", 0.0, 2.0 * math.pi, "to which side it is tilted"),
    Spread("temperature", "room_c", 10.0, 30.0, "an unheated workshop to a summer's day"),
    Spread(
        "temperature", "work", 0.0, 1.0, "just switched on to after work: 10 to 45 °C; beyond, the guard may stop it"
    ),
    Spread("supply", "supply_ratio", 0.9, 1.1, "5.4 to 6.6 V: bench supply or battery; units differ as much"),
    Spread("lateness", "late_s", 0.0, 0.010, "a desktop without a real-time kernel; the guard bears far more"),
    Spread("settings", "torque", 300.0, 1023.0, "grasping at low torque to the register's end", whole=True),
    Spread("settings", "speed", 100.0, 32766.0, "slow demonstrations to no limit", logarithmic=True, whole=True),
    Spread(
        "tension",
        "pretension_m",
        -1e-4,
        1e-4,
        "zeros of homing, stretch: open fingers of one hand rest at 65 to 390 mA by the day, 0.1 mm is 200 mA",
        each=True,
    ),
)
CONDITIONS = tuple(dict.fromkeys(span.kind for span in RANGES))
NOMINAL_V = 6.0
IDLE_RISE_C = 15.0
"""Steady temperature rise of an energised servo without load over the room, K (assumption)."""
WORK_RISE_C = 15.0
"""Temperature rise of servos after work over the room, K (assumption; recordings in use show 26 to 58 °C)."""
COPPER_PER_K = 0.0039
"""Relative rise of copper's resistance, per K; a warm motor has less torque at equal voltage."""
GREASE_PER_K = 0.01
"""Relative decrease of the gears' dry friction, per K (assumption: 20 % from 20 to 40 °C)."""


def drawn(seed: int, kinds: Collection[str] = CONDITIONS) -> Conditions:
    """Return random conditions of some kinds; the draw of a kind does not depend on the others.

    Raises:
        ValueError: a kind is unknown.
    """
    if unknown := sorted(set(kinds) - set(CONDITIONS)):
        raise ValueError(f"unknown condition {', '.join(unknown)}; choose from {', '.join(CONDITIONS)}")
    found: dict[str, Any] = {}
    for kind in CONDITIONS:
        random = np.random.default_rng([seed, crc32(kind.encode())])
        values = {span.name: span.draw(random) for span in RANGES if span.kind == kind}
        found |= values if kind in kinds else {}
    return Conditions(**found)
