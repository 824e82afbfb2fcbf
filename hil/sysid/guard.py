"""When a recording of a physical hand is broken off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class AbortLimits:
    """What a hand must not exceed while it is excited."""

    current_a: float = 4.0
    """Current of one channel, A: 88 % of the default torque limit of firmware 0.1.2 and later."""
    current_s: float = 0.3
    """How long the current may stay above that, s."""
    temperature_c: float = 65.0
    """Temperature of one servo, degC; the firmware itself throttles at 70."""
    stale_s: float = 0.2
    """How long readings may repeat to the last digit, s; currents of a powered servo are never that quiet."""
    deviation: float = 0.3
    """Difference of position and command, share of the window."""
    deviation_s: float = 0.6
    """How long the difference may last, s; the whole window takes a free shaft 0.5 s."""


class Guard:
    """Watches the readings of one recording."""

    def __init__(self, limits: AbortLimits) -> None:
        self._limits = limits
        self._since: dict[tuple[str, int], float] = {}
        self._last: bytes = b""

    def objection(self, t: float, command: Floats, position: Floats, current_a: Floats, celsius: Floats) -> str | None:
        """Return why to stop, None to go on.

        Args:
            t: time, s.
            command: (7,) shares of the window, the latest sent.
            position: (7,) shares of the window.
            current_a: (7,) A, any sign.
            celsius: (7,) degC, the latest read.
        """
        limits = self._limits
        hot = int(np.argmax(celsius))
        if celsius[hot] >= limits.temperature_c:
            return f"{Channel(hot).label} is at {celsius[hot]:.0f} °C, the limit is {limits.temperature_c:.0f} °C"
        for channel in Channel:
            if self._lasts("current", channel, abs(current_a[channel]) > limits.current_a, t) > limits.current_s:
                return (
                    f"{channel.label} drew {abs(current_a[channel]):.1f} A for more than {limits.current_s} s; "
                    "something blocks it"
                )
            off = position[channel] - command[channel]
            if self._lasts("deviation", channel, abs(off) > limits.deviation, t) > limits.deviation_s:
                return (
                    f"{channel.label} stands {off:+.0%} of its window away from its command; a slipped spool, a wrong "
                    "zero or a channel that moves the wrong way"
                )
        seen = position.tobytes() + current_a.tobytes()
        quiet, self._last = seen == self._last, seen
        if self._lasts("stale", -1, quiet, t) > limits.stale_s:
            return f"readings have not changed for {limits.stale_s} s; the board no longer reaches its servos"
        return None

    def _lasts(self, what: str, channel: int, true: bool, t: float) -> float:
        """Return for how long something has been true, s."""
        if not true:
            self._since.pop((what, channel), None)
            return 0.0
        return t - self._since.setdefault((what, channel), t)
