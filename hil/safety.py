"""What keeps a physical hand and its owner safe: every threshold in one place, and the watch over readings.

The watch is a state machine over readings and does nothing by itself; `hil.guarded_hand` feeds it and acts.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel

Floats = NDArray[np.float64]
FULL = 65535
LEAST_INTERVAL_S = 0.02
"""Readings closer than this are as old as each other."""


@dataclass(frozen=True)
class SafetyLimits:
    """Every threshold; the defaults follow one owner's practice (TTdragoAlex/tetherIA-aero-hand-open 58b518e)."""

    current_a: float = 4.0
    """Current of any channel ..."""
    current_s: float = 0.3
    """... that may last this long, s."""
    temperature_c: float = 65.0
    """Greatest temperature of any servo, degC."""
    stale_s: float = 0.2
    """Greatest age of telemetry, s: readings that repeat to the bit for longer."""
    speed_counts: float = 13000.0
    """Greatest speed an encoder may show, counts/s: half as much again as a servo without load."""
    stray: float = 0.1
    """Greatest motion of a channel whose command has rested for `settle_s`, part of the window."""
    settle_s: float = 2.0
    """Time after which a channel is taken to have followed its command, s."""
    watch_s: float = 0.05
    """Longest time between two looks while commands are sent, s."""
    torque_units: int = 600
    """Torque limit while experiments run, register units: 3.9 A, below the abort."""
    limp_units: int = 200
    """Torque limit the hand is left with, register units: 1.3 A."""
    gentle_s: float = 10.0
    """Time from the first command during which the speed is limited as well, s."""
    gentle_units: int = 60
    """Speed limit during that time, register units: 3000 counts/s."""
    open_s: float = 2.0
    """Time of the way back to the open hand, s."""

    def lines(self) -> list[str]:
        """Return every threshold as `name value`, for reports."""
        return [f"{field.name} {getattr(self, field.name):g}" for field in fields(self)]


class SafetyMonitor:
    """Looks at readings and says when to stop."""

    def __init__(self, limits: SafetyLimits, spans: NDArray[np.int64]) -> None:
        """Start; `spans` (7,) are the servo counts of each channel's window."""
        self._limits = limits
        self._spans = spans
        self._over_since: list[float | None] = [None] * len(Channel)
        self._fresh: tuple[float, bytes] | None = None
        self._codes: tuple[float, Floats] | None = None
        self._command: Floats | None = None
        self._commanded = np.full(len(Channel), -np.inf)
        self._rest: Floats | None = None

    def commanded(self, t: float, codes: Floats) -> None:
        """Note a command at `t` (s)."""
        changed = np.ones(len(Channel), bool) if self._command is None else codes != self._command
        self._commanded = np.where(changed, t, self._commanded)
        self._command = codes

    def look(self, t: float, codes: Floats, currents: Floats, temperatures: Floats) -> str | None:
        """Return why to stop, None when all is well.

        Args:
            t: time of the readings, s.
            codes: (7,) encoder codes.
            currents: (7,) A.
            temperatures: (7,) degC.
        """
        reasons = (
            self._heat(temperatures),
            self._current(t, currents),
            self._staleness(t, codes, currents),
            self._encoders(t, codes / FULL),
        )
        return next((reason for reason in reasons if reason is not None), None)

    def _heat(self, temperatures: Floats) -> str | None:
        hottest = int(np.argmax(temperatures))
        if temperatures[hottest] < self._limits.temperature_c:
            return None
        return (
            f"{Channel(hottest).label} is at {temperatures[hottest]:.0f} degC ({self._limits.temperature_c:g} allowed)"
        )

    def _current(self, t: float, currents: Floats) -> str | None:
        for channel in Channel:
            if abs(currents[channel]) < self._limits.current_a:
                self._over_since[channel] = None
                continue
            since = self._over_since[channel]
            if since is None:
                self._over_since[channel] = t
            elif t - since >= self._limits.current_s:
                return (
                    f"{channel.label} has drawn {abs(currents[channel]):.2f} A for {t - since:.2f} s "
                    f"({self._limits.current_a:g} A for {self._limits.current_s:g} s allowed)"
                )
        return None

    def _staleness(self, t: float, codes: Floats, currents: Floats) -> str | None:
        seen = codes.tobytes() + currents.tobytes()
        if self._fresh is None or self._fresh[1] != seen:
            self._fresh = t, seen
            return None
        age = t - self._fresh[0]
        if age <= self._limits.stale_s:
            return None
        return (
            f"telemetry has stood still for {age:.2f} s ({self._limits.stale_s:g} s allowed); a servo does not answer"
        )

    def _encoders(self, t: float, parts: Floats) -> str | None:
        before, self._codes = self._codes, (t, parts)
        resting = t - self._commanded > self._limits.settle_s
        rest, self._rest = self._rest, parts if self._rest is None else np.where(resting, self._rest, parts)
        if before is None or rest is None:
            return None
        speed = np.abs(parts - before[1]) * self._spans / max(t - before[0], LEAST_INTERVAL_S)
        fastest = int(np.argmax(speed))
        if speed[fastest] > self._limits.speed_counts:
            return (
                f"{Channel(fastest).label} encoder jumped, at {speed[fastest]:.0f} counts/s "
                f"({self._limits.speed_counts:g} allowed)"
            )
        strayed = np.where(resting, np.abs(parts - rest), 0.0)
        farthest = int(np.argmax(strayed))
        if strayed[farthest] > self._limits.stray:
            return (
                f"{Channel(farthest).label} moved by {strayed[farthest]:.0%} of its window without a command "
                f"({self._limits.stray:.0%} allowed)"
            )
        return None
