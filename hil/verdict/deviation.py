"""How a run departs from healthy hands: its readings on every channel and on the hand, as arrays.

What any hand reads is taken off, so that what is left belongs to what is wrong. `Limit.place` and `compressed` say
what a reading of 1 or 5 means.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from hil.checks import CHECKS, DRIVER, JUDGED
from hil.verdict.ending import CHANNEL_STOPS, ERRORS, HAND_STOPS
from hil.verdict.signature import Key, Places, compressed, out_of_limits

Floats = NDArray[np.float64]

HAND = "hand"
CHANNELS = {channel.label: channel for channel in Channel}
ABOUT_OTHERS = "audit/others_moved"
"""It says of a channel what the others did."""
OF_THE_HAND = tuple(
    check
    for check in CHECKS
    if check.experiment != DRIVER.name and not getattr(JUDGED[check.experiment], "asks", False)
)
"""Checks that read the hand; the others judge the driver, or ask a person."""
CHANNEL_READINGS = (
    *dict.fromkeys(
        f"{check.experiment}/{check.metric}"
        for check in OF_THE_HAND
        if check.subjects != (HAND,) and f"{check.experiment}/{check.metric}" != ABOUT_OTHERS
    ),
    *(f"ended/{stop}" for stop in CHANNEL_STOPS),
)
"""Rows of `Deviation.channels`."""
HAND_READINGS = (
    *dict.fromkeys(f"{check.experiment}/{check.metric}" for check in OF_THE_HAND if check.subjects == (HAND,)),
    *(f"ended/{end}" for end in (*HAND_STOPS, *ERRORS)),
)
"""Entries of `Deviation.hand`."""
COMMON = 0.2
"""Distance from the usual up to which a reading is that of any hand."""
HAND_WEIGHT = 1.5
"""A hand has one such reading where it has seven of the others."""
ENDED = 3.0
"""What an ending counts, on the scale of the readings."""


@dataclass(frozen=True, eq=False)
class Deviation:
    """How far off a run's readings are; NaN where nothing was measured, zero for what any hand reads."""

    channels: Floats
    """(len(CHANNEL_READINGS), 7)."""
    hand: Floats
    """(len(HAND_READINGS),)."""
    accused: NDArray[np.int64]
    """(7,) readings of each channel that are beyond a limit."""

    @property
    def energies(self) -> Floats:
        """How far each channel is off, (7,): the sum of the squares of its readings."""
        return np.asarray(np.nansum(self.channels**2, axis=0), np.float64)

    @property
    def total(self) -> float:
        """How far the whole run is off: the sum of all squares."""
        return float(self.energies.sum() + np.nansum(self.hand**2))


def deviation(found: Places, usual: Mapping[str, float], excesses: Mapping[Key, float] | None = None) -> Deviation:
    """Return how a run departs from healthy hands.

    Args:
        found: places of the run's readings, see `Limit.place`, and of its ending.
        usual: what a reading, `experiment/metric`, is on most hands once compressed; zero where it is left out.
        excesses: of the run's readings, see `Limit.excess`; none when None.
    """
    accused = np.zeros(len(Channel), np.int64)
    for (experiment, metric, subject), excess in (excesses or {}).items():
        if out_of_limits(excess) and subject in CHANNELS and f"{experiment}/{metric}" != ABOUT_OTHERS:
            accused[CHANNELS[subject]] += 1
    channels = np.full((len(CHANNEL_READINGS), len(Channel)), np.nan)
    hand = np.full(len(HAND_READINGS), np.nan)
    channels[[name.startswith("ended/") for name in CHANNEL_READINGS]] = 0.0
    hand[[name.startswith("ended/") for name in HAND_READINGS]] = 0.0
    for (experiment, metric, subject), place in found.items():
        name = f"{experiment}/{metric}"
        value = ENDED if experiment == "ended" else off(compressed(place), usual.get(name, 0.0))
        if subject == HAND and name in HAND_READINGS:
            hand[HAND_READINGS.index(name)] = HAND_WEIGHT * value
        elif subject in CHANNELS and name in CHANNEL_READINGS:
            channels[CHANNEL_READINGS.index(name), CHANNELS[subject]] = value
    return Deviation(channels, hand, accused)


def off(value: float, usual: float) -> float:
    """Return what is left of a compressed place beyond what any hand reads."""
    return float(np.copysign(max(0.0, abs(value - usual) - COMMON), value - usual))
