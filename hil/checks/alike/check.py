"""Alike: what the servos of one hand have in common.

They stand in one room, so they differ less from each other than hands do. It is no experiment of its own: it is
measured on the readings of the others.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from aero.channels import Channel
from hil.checks.shared.experiment import Measured, finite


def measure(numbers: Mapping[str, Measured]) -> Measured:
    """Return each servo's temperature less the median of the others', K; nothing where most others have none.

    Args:
        numbers: what was measured, by experiment.
    """
    presence = numbers.get("presence", {})
    values = {c: value for c in Channel if (value := finite(presence, c.label, "temperature")) is not None}
    found: dict[str, dict[str, float]] = {channel.label: {} for channel in Channel}
    for channel, value in values.items():
        others = [other for one, other in values.items() if one != channel]
        if len(others) >= len(Channel) // 2:
            found[channel.label]["temperature"] = value - float(np.median(others))
    return found
