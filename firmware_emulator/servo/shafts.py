"""Plant access for servos, sampled and driven only on the time grids of the servo loop.

The plant therefore integrates whole ticks, independent of bus traffic between ticks, and a telemetry cycle of seven
servos costs one call.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from firmware_emulator.kernel import Kernel
from firmware_emulator.plant import Drive, Plant


class Sample(NamedTuple):
    """Shafts at one refresh, in command order."""

    time: float
    """Time, s."""
    angles: list[float]
    """Angles, rad."""
    speeds: list[float]
    """Speeds, rad/s."""
    efforts: list[float]
    """Efforts before back-EMF, N m."""


class Shafts:
    """Plant on the servos' time grids: a fine grid for goals, a coarse one for measurements and running setpoints."""

    def __init__(self, kernel: Kernel, plant: Plant, *, loop_period_s: float, refresh_period_s: float) -> None:
        self._kernel = kernel
        self._plant = plant
        self._period = loop_period_s
        self._refresh = refresh_period_s
        # Seven servos sample at one instant: caching the time skips the arithmetic for six of them.
        self._sampled, self._looked = -1, -1.0
        self._advanced = -1.0
        """Time of the last `advance`, s; seven servos apply their goals at one instant."""
        self._sample = Sample(0.0, [], [], [])
        self._moving: dict[int, Callable[[float], float | None]] = {}
        self._ticking = False
        self._drives: dict[int, Drive] = {}
        self._aims: dict[int, float] = {}

    def connect(self, plant: Plant) -> None:
        """Replace the plant, keeping the drives; the new plant must be at the time of the old one."""
        self.advance()
        self._plant = plant
        for shaft, drive in self._drives.items():
            plant.drive(shaft, replace(drive, setpoint=self._aims[shaft]))
        self._forget_sample()

    def next_tick(self, t: float) -> float:
        """Return the time (s) of the first tick at or after `t`."""
        return math.ceil(t / self._period - 1e-6) * self._period

    def sample(self) -> Sample:
        """Return the state at the last refresh."""
        now = self._kernel.now
        if now == self._looked:
            return self._sample
        refresh = math.floor(now / self._refresh + 1e-6)
        if refresh != self._sampled:
            plant, t = self._plant, refresh * self._refresh
            plant.advance_to(t)
            self._sample = Sample(t, *plant.state())
            self._sampled = refresh
        self._looked = now
        return self._sample

    def advance(self) -> None:
        """Advance the plant to the last tick."""
        now = self._kernel.now
        if now != self._advanced:
            self._plant.advance_to(math.floor(now / self._period + 1e-6) * self._period)
            self._advanced = now

    def drive(self, shaft: int, drive: Drive) -> None:
        """Change a shaft's drive at the last tick."""
        self.advance()
        self._drives[shaft], self._aims[shaft] = drive, drive.setpoint
        self._plant.drive(shaft, drive)
        self._forget_sample()

    def aim(self, shaft: int, setpoint: float) -> None:
        """Change the setpoint (rad) of a shaft's drive at the last tick."""
        self.advance()
        self._aims[shaft] = setpoint
        self._plant.set_setpoint(shaft, setpoint)
        self._forget_sample()

    def follow(self, shaft: int, setpoint: Callable[[float], float | None] | None) -> None:
        """Update a shaft's setpoint (rad) at every refresh from a function of time (s), until it returns None."""
        if setpoint is None:
            self._moving.pop(shaft, None)
            return
        self._moving[shaft] = setpoint
        if not self._ticking:
            self._ticking = True
            self._tick()

    def _forget_sample(self) -> None:
        self._sampled, self._looked = -1, -1.0

    def _tick(self) -> None:
        now = self._kernel.now
        self.advance()
        self._forget_sample()
        for shaft, setpoint in list(self._moving.items()):
            angle = setpoint(now)
            if angle is None:
                del self._moving[shaft]
            else:
                self._aims[shaft] = angle
                self._plant.set_setpoint(shaft, angle)
        self._ticking = bool(self._moving)
        if self._ticking:
            following = math.floor(now / self._refresh + 1e-6) + 1
            self._kernel.call_at(following * self._refresh, self._tick)
