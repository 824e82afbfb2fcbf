"""What a staircase says about each cable: its spring load, its friction, and how much of it was slack.

At every level the servo's current is read once on the way up and once on the way down. Half their sum is the load
that the return springs put on the cable, half their difference is friction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import CABLES, Channel
from hil.checks.shared.signals import closing_current, find_steps
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recording import Recording

Floats = NDArray[np.float64]

TAUT_A = 0.04
"""Spring load from which a cable counts as taut. Slack cables of emulated hands read up to 0.01 A; a taut one of weak
springs reads 0.07 A with the palm down, where the finger's weight closes it."""
MIDDLE = slice(0.3, 0.8)
"""Part of the sweep whose median stands for the channel: clear of take-up and of end stops."""
EARLY, LATE = (0.15, 0.45), (0.55, 0.85)
"""Parts of the sweep whose spring loads are compared: clear of take-up, and of the stop, where a motor may stall."""


@dataclass(frozen=True)
class Load:
    """One cable's load over its sweep."""

    travel_mm: Floats
    """(n,) cable travel at each level but the top, on the way up."""
    spring_a: Floats
    """(n,) half the sum of both ways."""
    friction_a: Floats
    """(n,) half the difference."""

    @property
    def take_up_mm(self) -> float:
        """Travel of the last level that is still slack; zero when the first is taut, all of it when none is."""
        taut = np.flatnonzero(self.spring_a >= TAUT_A)
        slack = int(taut[0]) if taut.size else len(self.spring_a)
        return float(self.travel_mm[slack - 1]) if slack else 0.0

    @property
    def spring(self) -> float:
        """Median spring load in the middle of the sweep, A."""
        return float(np.median(self.spring_a[self._middle]))

    @property
    def friction(self) -> float:
        """Upper quartile of the friction in the middle of the sweep, A: a stiff joint may move in a part of it only."""
        return float(np.quantile(self.friction_a[self._middle], 0.75))

    @property
    def spring_shape(self) -> float:
        """Spring load of the second half over that of the first; NaN where that carries no load.

        Springs of one finger that are stronger or weaker together leave it as it is; one joint's alone changes it.
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
    pull = closing_current(currents.values, recording.header.hand)
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
