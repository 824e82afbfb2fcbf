"""Time as the driver sees it: something that tells the time and can be waited on."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Protocol


class Clock(Protocol):
    """The one owner of time; real or virtual, seconds from an arbitrary start, never backwards."""

    def now(self) -> float:
        """Return the time in s."""
        ...

    def sleep_until(self, t: float) -> None:
        """Return when `now()` is at least `t` (s); at once when it already is."""
        ...


class WallClock:
    """The machine's monotonic clock, for real ports."""

    def now(self) -> float:
        """Return the monotonic time in s."""
        return time.monotonic()

    def sleep_until(self, t: float) -> None:
        """Sleep until the monotonic time is `t` (s)."""
        time.sleep(max(0.0, t - time.monotonic()))


@dataclass(frozen=True)
class Deadline:
    """A point in time that several waits share, so that retries cannot add up to more than was asked for."""

    clock: Clock
    at: float

    @classmethod
    def after(cls, clock: Clock, seconds: float) -> Deadline:
        """Return the deadline `seconds` from now."""
        return cls(clock, clock.now() + seconds)

    @property
    def remaining(self) -> float:
        """Seconds left, not below zero."""
        return max(0.0, self.at - self.clock.now())

    @property
    def expired(self) -> bool:
        """Whether no time is left."""
        return self.remaining == 0.0
