"""Alike: what the servos and the fingers of one hand have in common, and what stays the same in the course of a run.

Supply, firmware and room are those of one hand, so its channels differ less from each other than hands do. It is no
experiment of its own: it is measured on the readings of the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from aero.channels import CABLES, Channel
from hil.checks.shared.experiment import Measured, finite

LEAST_A = 0.1
"""Current from which on two of one posture are compared, A."""


def measure(numbers: Mapping[str, Measured]) -> Measured:
    """Return, by channel, its readings beside those of the others, and its load beside that of a later time.

    `temperature` is °C less the median of the other six; `held_again` the current of the grasp that is held, % of that
    at the same place in the staircase. One that the others do not let be compared is left out.

    Args:
        numbers: what was measured, by experiment.
    """
    found: dict[str, dict[str, float]] = {channel.label: {} for channel in Channel}
    for channel, value, others in _beside(numbers.get("presence", {}), "temperature"):
        found[channel.label]["temperature"] = value - others
    for channel in CABLES:
        held = finite(numbers.get("holding", {}), channel.label, "holding_current")
        later = finite(numbers.get("staircase", {}), channel.label, "held")
        if held is not None and later is not None and min(held, later) > LEAST_A:
            found[channel.label]["held_again"] = 100.0 * later / held
    return found


def _beside(measured: Measured, metric: str) -> Iterator[tuple[Channel, float, float]]:
    """Yield each channel's reading, and the median of the others'."""
    values = {c: value for c in Channel if (value := finite(measured, c.label, metric)) is not None}
    for channel, value in values.items():
        others = [other for one, other in values.items() if one != channel]
        if len(others) >= len(Channel) // 2:
            yield channel, value, float(np.median(others))
