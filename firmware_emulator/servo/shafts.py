"""The plant as servos see it: sampled and changed only on the grids of the servos' own loop.

That keeps the plant's integration regular: whatever the bus does between two ticks, the plant is asked for whole
ticks, and a telemetry cycle of seven servos costs one call.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from firmware_emulator.kernel import Kernel
from firmware_emulator.plant import Drive, Plant


class Sample(NamedTuple):
    """The shafts at one refresh, in command order."""

    time: float
    """s."""
    angles: list[float]
    """rad."""
    speeds: list[float]
    """rad/s."""
    efforts: list[float]
    """N m."""


class Shafts:
    """A plant on the servos' time grids: a fine one for goals, a coarse one for measurements and running setpoints."""

    def __init__(self, kernel: Kernel, plant: Plant, *, loop_period_s: float, refresh_period_s: float) -> None:
        self._kernel = kernel
        self._plant = plant
        self._period = loop_period_s
        self._refresh = refresh_period_s
        # Seven servos sample at one instant: the last sample is found by its time, without arithmetic.
        self._sampled, self._looked = -1, -1.0
        self._advanced = -1.0
        """When the plant was last brought to a tick, s: seven servos act on their goals at one instant."""
        self._sample = Sample(0.0, [], [], [])
        self._moving: dict[int, Callable[[float], float | None]] = {}
        self._ticking = False
        self._drives: dict[int, Drive] = {}
        self._aims: dict[int, float] = {}

    def connect(self, plant: Plant) -> None:
        """Turn another plant from now on, that is at the same time: something was put in between, or taken out."""
        self.advance()
        self._plant = plant
        for shaft, drive in self._drives.items():
            plant.drive(shaft, replace(drive, setpoint=self._aims[shaft]))
        self._forget_sample()

    def next_tick(self, t: float) -> float:
        """Return the time (s) of the first tick at or after `t`."""
        return math.ceil(t / self._period - 1e-6) * self._period

    def sample(self) -> Sample:
        """Return the state at the last refresh that is over."""
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
        """Bring the plant to the last tick that has passed."""
        now = self._kernel.now
        if now != self._advanced:
            self._plant.advance_to(math.floor(now / self._period + 1e-6) * self._period)
            self._advanced = now

    def drive(self, shaft: int, drive: Drive) -> None:
        """Change a shaft's drive from the last tick on."""
        self.advance()
        self._drives[shaft], self._aims[shaft] = drive, drive.setpoint
        self._plant.drive(shaft, drive)
        self._forget_sample()

    def aim(self, shaft: int, setpoint: float) -> None:
        """Change the setpoint (rad) of a shaft's drive from the last tick on."""
        self.advance()
        self._aims[shaft] = setpoint
        self._plant.set_setpoint(shaft, setpoint)
        self._forget_sample()

    def follow(self, shaft: int, setpoint: Callable[[float], float | None] | None) -> None:
        """Move a shaft's setpoint along a function of time (s) to rad at every refresh until it returns None."""
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
