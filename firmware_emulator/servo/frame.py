"""Conversion between shaft angle and encoder counts: mounting, stored offset and counted turns."""

import math
from dataclasses import dataclass

from firmware_emulator.servo.parameters import COUNTS_PER_TURN, RAD_PER_COUNT


@dataclass(frozen=True)
class Mounting:
    """Mounting of a servo on its shaft."""

    shaft: int
    """Index of the shaft in command order."""
    direction: int
    """Direction: +1 if counts grow as the channel closes, else -1."""
    zero_counts: float
    """Encoder reading at shaft angle zero without offset, counts."""


class Frame:
    """Counts of one servo: `present = encoder - offset - 4096 turns`, with an unbounded encoder reading."""

    def __init__(self, mounting: Mounting, counts_per_turn: float = COUNTS_PER_TURN, *, wraps: bool = True) -> None:
        """Mount a servo; without `wraps` it has a potentiometer, without turns and offset."""
        self._mounting = mounting
        self._turns = 0
        self._offset = 0
        self._wraps = wraps
        self.counts_per_rad = mounting.direction / (RAD_PER_COUNT * COUNTS_PER_TURN / counts_per_turn)
        """Counts per radian of shaft angle, with the sign of the mounting."""
        self._zero = mounting.zero_counts
        self.rounding_zero = self._zero + 0.5
        """Reading at shaft angle zero plus half a count, so that `floor` rounds to nearest."""

    @property
    def offset(self) -> int:
        """Offset register's part of the shift, counts, -2048..2047."""
        return self._offset

    def counts(self, angle: float) -> int:
        """Return the reading (counts) at a shaft angle (rad)."""
        return math.floor(self.rounding_zero + self.counts_per_rad * angle)

    def angle(self, counts: float) -> float:
        """Return the shaft angle (rad) at a reading (counts)."""
        return (counts - self._zero) / self.counts_per_rad

    def calibrate(self, angle: float, value: int) -> None:
        """Shift the counts so that this shaft angle (rad) reads `value`."""
        shift = self.counts(angle) + self._offset + self._turns * COUNTS_PER_TURN - value
        self._offset = (shift + COUNTS_PER_TURN // 2) % COUNTS_PER_TURN - COUNTS_PER_TURN // 2
        self._place((shift - self._offset) // COUNTS_PER_TURN)

    def forget_turns(self, angle: float) -> None:
        """Clear the counted turns, as at power-up: reduce the reading modulo 4096."""
        if self._wraps:
            self._place(self._turns + self.counts(angle) // COUNTS_PER_TURN)

    def set_offset(self, offset: int) -> None:
        """Apply the offset register's value (counts)."""
        self._offset = offset
        self._place(self._turns)

    def _place(self, turns: int) -> None:
        self._turns = turns
        self._zero = self._mounting.zero_counts - self._offset - turns * COUNTS_PER_TURN
        self.rounding_zero = self._zero + 0.5
