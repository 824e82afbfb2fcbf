"""Alike: comparison of a hand with itself: of its servos at rest, and of its pace at the start and the end of a run.

The servos are in the same room, and the supply and the fingers are the same, so these readings differ less within a
hand than between hands. Not an experiment: measured on the readings of the other experiments.
"""

from collections.abc import Mapping

import numpy as np

from aero.channels import Channel
from hil.checks.shared.experiment import Measured, finite


def measure(numbers: Mapping[str, Measured]) -> Measured:
    """Return each servo's temperature minus the median of the others, K, and the change of the hand's pace, %.

    The pace changes from `response` to `drift`. What was not measured is left out, and the temperatures too if most
    servos have none.

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
    first, last = (finite(numbers.get(name, {}), "hand", "open_close_rate") for name in ("response", "drift"))
    if first and last:
        found["hand"] = {"pace_change": 100.0 * (last / first - 1.0)}
    return found
