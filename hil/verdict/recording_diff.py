"""Two recordings of the same experiment, channel by channel: two hands, or a hand and its emulated twin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks import EXPERIMENTS
from hil.checks.shared.signals import at_times
from hil.recordings.recording import Recording


@dataclass(frozen=True)
class ChannelDiff:
    """One channel of two recordings; encoder differences in per cent of the window."""

    rms: float
    """Root mean square of second less first, at the first's sample times."""
    mean: float
    """Mean of second less first."""
    worst: float
    """Greatest magnitude, with its sign."""
    metrics: dict[str, tuple[float, float]]
    """What the experiment measures on this channel: first and second."""


def diff(first: Recording, second: Recording) -> dict[Channel, ChannelDiff]:
    """Compare two recordings of one experiment.

    Raises:
        ValueError: they are of different experiments.
    """
    names = {first.header.experiment, second.header.experiment}
    if len(names) > 1 or not names <= EXPERIMENTS.keys():
        raise ValueError(f"a difference needs two recordings of one experiment, not of {' and '.join(sorted(names))}")
    experiment = EXPERIMENTS[first.header.experiment]
    one, other = experiment.measure(first), experiment.measure(second)
    times = first["codes"].times
    error = (at_times(second["codes"].times, second["codes"].values, times) - first["codes"].values) * 100.0 / MAX_CODE
    return {
        channel: ChannelDiff(
            rms=float(np.sqrt(np.mean(np.square(error[:, channel])))),
            mean=float(np.mean(error[:, channel])),
            worst=_signed_extreme(error[:, channel]),
            metrics={
                name: (float(value), float(other.get(channel.label, {}).get(name, np.nan)))
                for name, value in one.get(channel.label, {}).items()
            },
        )
        for channel in Channel
    }


def _signed_extreme(values: NDArray[np.float64]) -> float:
    return float(values[int(np.argmax(np.abs(values)))])
