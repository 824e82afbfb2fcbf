"""Waiting without losing sight of the hand."""

from __future__ import annotations

from collections.abc import Callable

from aero.clock import Clock, finite_s


class WatchedClock:
    """A clock whose waits are cut into pieces, with a look at the hand after each."""

    def __init__(self, clock: Clock, look: Callable[[], None], piece_s: float) -> None:
        self._clock = clock
        self._look = look
        self._piece_s = piece_s

    @property
    def bare(self) -> Clock:
        """The clock behind."""
        return self._clock

    def now(self) -> float:
        """Return the time in s."""
        return self._clock.now()

    def sleep_until(self, t: float) -> None:
        """Return when `now()` is at least `t` (s).

        Raises:
            ValueError: `t` is not finite.
            SafetyStopError: what `look` raises.
        """
        finite_s(t)
        while (now := self._clock.now()) < t:
            self._clock.sleep_until(min(t, now + self._piece_s))
            self._look()
