"""Alike: comparison of the servos of one hand.

The servos are in the same room, so they differ less among each other than between hands. Not an experiment: measured on
the readings of the other experiments.
"""

from collections.abc import Mapping

import numpy as np

from aero.channels import Channel
from hil.checks.shared.experiment import Measured, finite


def measure(numbers: Mapping[str, Measured]) -> Measured:
    """Return each servo's temperature minus the median of the others, K; nothing if most others have none.

    Args:
        numbers: readings by experiment.
    """
    presence = numbers.get("presence", {})
    values = {c: value for c in Channel if (value := finite(presence, c.label, "temperature")) is not None}
    found: dict[str, dict[str, float]] = {channel.label: {} for channel in Channel}
    for channel, value in values.items():
        others = [other for one, other in values.items() if one != channel]
        if len(others) >= len(Channel) // 2:
            found[channel.label]["temperature"] = value - float(np.median(others))
    return found
