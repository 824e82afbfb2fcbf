"""Time as the driver sees it: something that tells the time and can be waited on."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple, Protocol


def _going_on() -> Callable[[], float]:
    """Return a monotonic clock that runs while the machine sleeps, unlike Python's on Linux and macOS."""
    for name in ("CLOCK_BOOTTIME", "CLOCK_MONOTONIC"):  # of Linux, and of macOS, which has no other
        if hasattr(time, name):
            return partial(time.clock_gettime, getattr(time, name))
    return time.monotonic  # Windows


_NOW = _going_on()


def positive_s(name: str, seconds: float) -> float:
    """Return a time, s.

    Raises:
        ValueError: it is not positive and finite; the message names it.
    """
    if not (math.isfinite(seconds) and seconds > 0):
        raise ValueError(f"{name}: expected a positive time in s, got {seconds!r}")
    return seconds


def finite_s(t: float) -> float:
    """Return a moment to wait for, s.

    Raises:
        ValueError: it is not finite, so that it never comes or has always been.
    """
    if not math.isfinite(t):
        raise ValueError(f"sleep_until: expected a time in s, got {t!r}")
    return t


class Clock(Protocol):
    """The one owner of time; real or virtual, seconds from an arbitrary start, never backwards."""

    def now(self) -> float:
        """Return the time in s."""
        ...

    def sleep_until(self, t: float) -> None:
        """Return when `now()` is at least `t` (s); at once when it already is."""
        ...


class WallClock:
    """The machine's clock since it started, for real ports; it runs while the machine is suspended."""

    def now(self) -> float:
        """Return the time in s."""
        return _NOW()

    def sleep_until(self, t: float) -> None:
        """Sleep until the time is `t` (s)."""
        time.sleep(max(0.0, finite_s(t) - _NOW()))


class Deadline(NamedTuple):
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
