"""Motion of a served hand: its true state over time, whatever its replies say."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aero.floats import Floats
from hil.emulated.hand_source import EmulatedSource

PERIOD_S = 0.02
"""Sampling period, s of the hand's clock."""
STORED = 30_000
"""Limit of samples in memory: ten minutes."""


@dataclass(frozen=True)
class TrueMotion:
    """True state of an emulated hand over time. Arrays over channels are in command order; NaN marks unknown values."""

    t: Floats
    """Times, (n,) s since the hand was switched on."""
    joints: Floats
    """Joint angles, (n, 16) rad, in the order of `aero.channels.Joint`."""
    commanded: Floats
    """Shaft angles in the servos' goal registers, (n, 7) rad."""
    measured: Floats
    """Shaft angles by the encoders, (n, 7) rad."""
    currents: Floats
    """Motor currents, (n, 7) A, magnitude."""
    temperatures: Floats
    """Servo temperatures, (n, 7) °C."""
    tensions: Floats
    """Cable tensions, (n, 7) N."""

    @classmethod
    def of(cls, rows: Sequence[Sequence[Any]]) -> TrueMotion:
        """Return the samples of rows as `MotionSampler` stores them."""
        columns = zip(*rows, strict=True) if rows else [()] * len(FIELDS)
        return cls(*(np.array(column, float) for column in columns))


FIELDS = tuple(TrueMotion.__dataclass_fields__)


class MotionSampler:
    """Samples of a served hand, taken by its serving loop."""

    def __init__(self, source: EmulatedSource) -> None:
        self._source, self._due_s = source, 0.0
        self._rows: deque[list[Any]] = deque(maxlen=STORED)

    def sample(self, now_s: float) -> None:
        """Store the present state if a sample is due."""
        if now_s >= self._due_s:
            self._due_s = now_s + PERIOD_S
            frame = self._source.frame()
            self._rows.append([np.asarray(getattr(frame, name)).round(6).tolist() for name in FIELDS])

    def rows(self) -> list[list[Any]]:
        """Return the stored samples."""
        return list(self._rows)
