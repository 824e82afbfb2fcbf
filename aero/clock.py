"""Clock interface of the driver (read the time, wait until a time), the wall clock, and deadlines."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple, Protocol


def _going_on() -> Callable[[], float]:
    """Return a monotonic clock that counts suspended time, unlike `time.monotonic` on Linux and macOS."""
    for name in ("CLOCK_BOOTTIME", "CLOCK_MONOTONIC"):  # Linux has the first, macOS only the second
        if hasattr(time, name):
            return partial(time.clock_gettime, getattr(time, name))
    return time.monotonic  # Windows


_NOW = _going_on()


def positive_s(name: str, seconds: float) -> float:
    """Return `seconds` unchanged if positive and finite.

    Raises:
        ValueError: zero, negative or not finite; the message has `name`.
    """
    if not (math.isfinite(seconds) and seconds > 0):
        raise ValueError(f"{name}: expected a positive time in s, got {seconds!r}")
    return seconds


def finite_s(t: float) -> float:
    """Return `t` (s) unchanged if finite.

    Raises:
        ValueError: NaN or infinity.
    """
    if not math.isfinite(t):
        raise ValueError(f"sleep_until: expected a time in s, got {t!r}")
    return t


class Clock(Protocol):
    """Single owner of time, real or virtual: seconds from an arbitrary start, never decreasing."""

    def now(self) -> float:
        """Return the time in s."""
        ...

    def sleep_until(self, t: float) -> None:
        """Wait until `now()` is at least `t` (s); return at once for a past time."""
        ...


class WallClock:
    """Time since this computer started, for real ports; counts suspended time."""

    def now(self) -> float:
        """Return the time in s."""
        return _NOW()

    def sleep_until(self, t: float) -> None:
        """Sleep until the time is `t` (s)."""
        time.sleep(max(0.0, finite_s(t) - _NOW()))


class Deadline(NamedTuple):
    """Point in time shared by several waits, so that retries cannot exceed the caller's time-out."""

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
        """True once no time is left."""
        return self.remaining == 0.0
