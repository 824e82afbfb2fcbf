"""Estimate of the time for which a grip can be held, from temperatures and currents.

A motor's heat reaches the sensor by two ways, a fast and a slow one. Each adds `RISE` times the squared current, with
its own time constant. The rest of the measured temperature is the surroundings'.
"""

import math
from typing import NamedTuple

import numpy as np

from aero.channels import Channel
from aero.floats import Floats

RISE = ((1.1, 15.0), (3.0, 400.0))
"""Final rise, K per A² of the nominal scale, and its time constant, s. Fitted by hand to the maker's table: 80 °C after
20 s, 2 to 3 min, 5 to 7 min and never, at torques of 1000, 700, 600 and 500 units (aero-open-docs, hardware FAQ)."""
CUT_C = 80.0
"""Temperature at which a servo releases its torque, °C (same source)."""
SMOOTHED_S = 2.0
"""Time constant of the averaged squared current, s."""
MOST_S = 3600.0
"""Longest predicted time, s."""
_STEPS = np.arange(1.0, MOST_S + 1.0)


class Grip(NamedTuple):
    """Channel that limits the time of a grip."""

    channel: Channel
    celsius: float
    current_a: float
    limit_s: float
    """Time to the guard's limit, s; infinite if it is not reached within `MOST_S`."""
    cut_s: float
    """Time to the servo's own protection at `CUT_C`, s; otherwise as `limit_s`."""
    limit_c: float

    def __str__(self) -> str:
        seen = f"{self.channel.label} {self.celsius:.0f} °C at {self.current_a:.1f} A"
        if math.isinf(self.limit_s):
            return f"{seen}: this grip stays below {self.limit_c:.0f} °C for an hour or longer"
        later = "" if math.isinf(self.cut_s) else f", {CUT_C:.0f} °C in about {self.cut_s:.0f} s"
        return f"{seen}: {self.limit_c:.0f} °C, where the guard opens, in about {self.limit_s:.0f} s{later}"


class HeatWatch:
    """Heat of the seven motors, followed from the readings of a guard."""

    def __init__(self, limit_c: float) -> None:
        """Start with cold motors; `limit_c` (°C) is the guard's limit."""
        self._limit_c = limit_c
        self._t: float | None = None
        self._squared = np.zeros(len(Channel))
        self._stored = np.zeros((len(RISE), len(Channel)))
        self._celsius: Floats | None = None

    def drawn(self, t: float, currents_a: Floats) -> None:
        """Follow currents, (7,) A, at `t` (s)."""
        passed_s = math.inf if self._t is None else t - self._t
        self._t = t
        share = 1.0 - math.exp(-passed_s / SMOOTHED_S)
        passed_s = passed_s if math.isfinite(passed_s) else 0.0
        self._squared += share * (currents_a**2 - self._squared)
        for way, (rise, constant_s) in enumerate(RISE):
            self._stored[way] += (1.0 - math.exp(-passed_s / constant_s)) * (rise * self._squared - self._stored[way])

    def felt(self, celsius: Floats) -> None:
        """Follow temperatures, (7,) °C."""
        self._celsius = celsius

    def grip(self) -> Grip | None:
        """Return the channel that reaches the guard's limit first; None without readings."""
        if self._celsius is None or self._t is None:
            return None
        grips = [self._of(channel) for channel in Channel]
        return min(grips, key=lambda one: (one.limit_s, -one.celsius))

    def _of(self, channel: Channel) -> Grip:
        squared, stored = self._squared[channel], self._stored[:, channel]
        curve = np.full(len(_STEPS), self._celsius[channel] if self._celsius is not None else math.nan)
        for now, (rise, constant_s) in zip(stored, RISE, strict=True):
            curve += (rise * squared - now) * (1.0 - np.exp(-_STEPS / constant_s))
        times = [_first(curve >= most) for most in (self._limit_c, CUT_C)]
        celsius = float(self._celsius[channel]) if self._celsius is not None else math.nan
        return Grip(channel, celsius, math.sqrt(squared), times[0], times[1], self._limit_c)


def _first(reached: np.ndarray) -> float:
    return float(_STEPS[np.argmax(reached)]) if reached.any() else math.inf
