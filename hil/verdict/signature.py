"""The signature of a run: where its readings lie among those of healthy hands, seen from one channel.

The seven channels of a hand suffer the same faults, so a signature is told as "this channel", "the worst of the
others" and "the hand": a fault that was once seen on the index is known on the ring and on the thumb. A reading inside
the limits counts too: one that alone accuses nobody tells one cause from another.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from aero.channels import Channel
from hil.checks import Measured
from hil.verdict.limits import Limit

Key = tuple[str, str, str]
"""Experiment, metric and subject."""
Places = Mapping[Key, float]
"""Where readings lie among those of healthy hands, see `Limit.place`."""
Signature = Mapping[str, float]
"""Feature to compressed place; a feature that is left out is zero."""

COMMON = 1.0
"""Compressed place up to which a reading is that of any hand; it is taken off."""
MOST = 1000.0
"""Place from which on a reading counts as no further off."""


def out_of_limits(excess: float) -> bool:
    """Return whether a reading with this excess (`Limit.excess`) is beyond its limit."""
    return abs(excess) > 1.0


def excesses(numbers: Mapping[str, Measured], limits: Sequence[Limit]) -> dict[Key, float]:
    """Return the excess of every judged reading of a run (`Limit.excess`); what was not measured is left out."""
    return {key: limit.excess(value) for key, limit, value in _judged(numbers, limits)}


def places(numbers: Mapping[str, Measured], limits: Sequence[Limit]) -> dict[Key, float]:
    """Return the place of every judged reading of a run (`Limit.place`); what was not measured is left out."""
    return {key: limit.place(value) for key, limit, value in _judged(numbers, limits)}


def signature(found: Places, channel: Channel | None) -> dict[str, float]:
    """Return a run's signature as seen from a channel, or from the whole hand when None.

    Args:
        found: places of the run's readings, and of its ending where it has one (`EndSignature.places`).
        channel: the suspect.
    """
    features: dict[str, float] = {}
    for (experiment, metric, subject), place in found.items():
        value = compressed(place)
        if subject == "hand":
            role = "hand"
        elif channel is not None and subject == channel.label:
            role = "own"
        else:
            role = "others"
        name = f"{role}/{experiment}/{metric}"
        if abs(value) > abs(features.get(name, 0.0)):
            features[name] = value
    return features


def compressed(place: float) -> float:
    """Return a place on a scale on which ten times as far off is not ten times as telling; 0 for a common one."""
    far = math.asinh(2.0 * min(abs(place), MOST))
    return math.copysign(max(0.0, far - COMMON), place)


def _judged(numbers: Mapping[str, Measured], limits: Sequence[Limit]) -> Iterator[tuple[Key, Limit, float]]:
    for limit in limits:
        measured = numbers.get(limit.experiment, {})
        for subject in limit.subjects:
            if limit.metric in measured.get(subject, {}):
                yield (limit.experiment, limit.metric, subject), limit, measured[subject][limit.metric]
