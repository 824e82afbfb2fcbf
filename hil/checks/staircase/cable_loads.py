"""Load of each cable in a staircase: spring load, friction, slack.

The servo current is sampled at every level on the way up and on the way down. Half the sum is the load of the return
springs, half the difference is friction.
"""

from dataclasses import dataclass

import numpy as np

from aero.channels import CABLES, Channel
from aero.floats import Floats
from hil.checks.shared.signals import closing_current, find_steps
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recording import Recording

TAUT_A = 0.04
"""Threshold of the spring load, A; from it a cable counts as taut.

Slack cables of emulated hands read up to 0.01 A; a taut one with weak springs reads 0.07 A with the palm down, where
the finger's weight closes the finger.
"""
MIDDLE = slice(0.3, 0.8)
"""Part of the sweep for the channel's medians, clear of take-up and end stops."""
EARLY, LATE = (0.15, 0.45), (0.55, 0.85)
"""Parts of the sweep whose spring loads are compared, clear of take-up and of the stop, where a motor may stall."""


@dataclass(frozen=True)
class Load:
    """Load of one cable over its sweep."""

    travel_mm: Floats
    """Cable travel at each level below the top, on the way up, (n,), mm."""
    spring_a: Floats
    """Half the sum of the currents of both ways, (n,), A."""
    friction_a: Floats
    """Half the difference of the currents of both ways, (n,), A."""

    @property
    def take_up_mm(self) -> float:
        """Travel at the last slack level, mm; 0 if the first is taut, the whole travel if none is taut."""
        taut = np.flatnonzero(self.spring_a >= TAUT_A)
        slack = int(taut[0]) if taut.size else len(self.spring_a)
        return float(self.travel_mm[slack - 1]) if slack else 0.0

    @property
    def spring(self) -> float:
        """Median spring load in the middle of the sweep, A."""
        return float(np.median(self.spring_a[self._middle]))

    @property
    def friction(self) -> float:
        """Upper quartile of the friction in mid-sweep, A, to include a stiff joint that moves in only a part of it."""
        return float(np.quantile(self.friction_a[self._middle], 0.75))

    @property
    def spring_shape(self) -> float:
        """Ratio of the spring loads late and early in the sweep; NaN without load early in the sweep.

        A common change of a finger's springs does not affect the ratio; a change at one joint does.
        """
        halves = [self.spring_a[self._part(*part)] for part in (EARLY, LATE)]
        if not all(half.size for half in halves):  # a short staircase
            return np.nan
        early, late = (float(half.mean()) for half in halves)
        return late / early if early > TAUT_A else np.nan

    def _part(self, begin: float, end: float) -> slice:
        return slice(int(begin * len(self.spring_a)), max(1, int(end * len(self.spring_a))))

    @property
    def _middle(self) -> slice:
        n = len(self.spring_a)
        return slice(int(MIDDLE.start * n), max(int(MIDDLE.start * n) + 1, int(MIDDLE.stop * n)))


def loads(recording: Recording) -> dict[Channel, Load]:
    """Return the load of each cable from a staircase recording; the abduction has no cable.

    Raises:
        CannotBeMeasuredError: a channel has fewer than two levels.
    """
    command, currents, travel = (recording[name] for name in ("command", "currents", "travel"))
    pull = closing_current(currents.values, recording.header.side)
    steps = find_steps(command.times, command.values)
    found: dict[Channel, Load] = {}
    for channel in CABLES:
        ends = [step.end for step in steps if step.channel == channel]
        levels = len(ends) // 2
        if levels < 2:
            raise CannotBeMeasuredError(
                f"{channel.label}: a load needs at least two levels up and down, there are {levels}"
            )
        rows = np.searchsorted(currents.times, ends) - 1
        up, down = pull[rows[: levels - 1], channel], pull[rows[levels : 2 * levels - 1], channel][::-1]
        at = np.searchsorted(travel.times, ends[: levels - 1]) - 1
        found[channel] = Load(1e3 * travel.values[at, channel], (up + down) / 2, (up - down) / 2)
    return found
