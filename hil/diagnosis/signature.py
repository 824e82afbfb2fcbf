"""The signature of a run: how far each reading lies beyond those of healthy hands, seen from one channel.

The seven channels of a hand suffer the same faults, so a signature is told as "this channel", "the worst of the
others" and "the hand": a fault that was once seen on the index is known on the ring.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from aero.channels import Channel
from hil.experiments import Measured
from hil.experiments.shared.subjects import CHANNELS
from hil.judging.limits import UNMEASURED, Limit

Excesses = Mapping[tuple[str, str, str], float]
"""(experiment, metric, subject) to excess, see `Limit.excess`."""
Signature = Mapping[str, float]
"""Feature to compressed excess; a feature that is left out is zero."""

LEAST = 0.4
"""Compressed excess below which a feature is left out."""
MOST = 20.0
"""Excess from which on a reading counts as no further off."""
KINDS: dict[str, str] = {
    **dict.fromkeys(CHANNELS[:4], "finger"),
    **{channel: channel for channel in CHANNELS[4:]},
}
"""Channels that are built alike."""


def excesses(numbers: Mapping[str, Measured], limits: Sequence[Limit]) -> dict[tuple[str, str, str], float]:
    """Return the excess of every judged reading of a run; what was not measured is left out."""
    return {
        (limit.experiment, limit.metric, subject): limit.excess(measured[subject][limit.metric])
        for limit in limits
        for measured in [numbers.get(limit.experiment, {})]
        for subject in limit.subjects
        if limit.metric in measured.get(subject, {})
    }


def signature(found: Excesses, ended: str, not_run: Sequence[str], channel: Channel | None) -> dict[str, float]:
    """Return a run's signature as seen from a channel, or from the whole hand when None.

    Args:
        found: excesses of the run.
        ended: name of the error that ended it, empty when there was none.
        not_run: experiments that did not come to their end.
        channel: the suspect.
    """
    features = {f"not run/{name}": math.log1p(1.0) for name in not_run}
    if ended:
        features[f"ended/{ended}"] = math.log1p(UNMEASURED)
    for (experiment, metric, subject), excess in found.items():
        value = compressed(excess)
        if subject == "hand":
            role = "hand"
        elif channel is not None and subject == channel.label:
            role = "own"
        else:
            role = "others"
        name = f"{role}/{experiment}/{metric}"
        if abs(value) > abs(features.get(name, 0.0)):
            features[name] = value
    return {name: value for name, value in features.items() if abs(value) >= LEAST}


def compressed(excess: float) -> float:
    """Return an excess on a scale on which ten times as much is not ten times as far."""
    return math.copysign(math.log1p(min(abs(excess), MOST)), excess)
