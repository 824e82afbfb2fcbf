"""Comparison of two recordings by channel, without verdicts: two hands, or a hand and its emulated twin."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks import EXPERIMENTS
from hil.checks.shared.experiment import finite
from hil.checks.shared.signals import at_times
from hil.recordings.errors import UnusableFileError
from hil.recordings.recording import Recording
from hil.targets.hand_spec import hand_words


@dataclass(frozen=True)
class ChannelDiff:
    """Difference of one channel between two recordings; encoder differences in per cent of the window."""

    rms: float
    """Root mean square of second minus first, at the first's sample times."""
    mean: float
    """Mean of second minus first."""
    worst: float
    """Difference of greatest magnitude, signed."""
    metrics: dict[str, tuple[float | None, float | None]]
    """Metrics of the experiment on this channel: first and second, None if not measurable."""


def difference(first: Recording, second: Recording) -> dict[Channel, ChannelDiff]:
    """Compare two recordings of one experiment.

    Raises:
        UnusableFileError: the recordings are of different experiments.
    """
    names = {first.header.experiment, second.header.experiment}
    if len(names) > 1 or not names <= EXPERIMENTS.keys():
        of = " and ".join(sorted(names))
        raise UnusableFileError(f"a difference needs two recordings of one experiment, not of {of}")
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
                name: (finite(one, channel.label, name), finite(other, channel.label, name))
                for name in one.get(channel.label, {})
            },
        )
        for channel in Channel
    }


def _signed_extreme(values: NDArray[np.float64]) -> float:
    return float(values[int(np.argmax(np.abs(values)))])


def beside_text(first: Recording, second: Recording) -> Iterator[Text | Table]:
    """Yield the comparison of two recordings of one experiment, for a terminal.

    Raises:
        UnusableFileError: the recordings are of different experiments.
    """
    found = difference(first, second)
    for which, header in (("first", first.header), ("second", second.header)):
        words = hand_words(header.side, header.target, header.firmware, unit=header.unit, seed=header.seed)
        yield Text(f"{which:7} {header.experiment}, {words}")
    shown = Table("Channel", "rms", "mean", "worst", box=SIMPLE_HEAD, title="Encoders, second less first, % of window")
    for channel, row in found.items():
        shown.add_row(channel.label, f"{row.rms:.3f}", f"{row.mean:+.3f}", f"{row.worst:+.2f}")
    yield shown
    for channel, row in found.items():
        changes = [f"{name} {_number(a)} to {_number(b)}" for name, (a, b) in row.metrics.items() if a != b]
        if changes:
            yield Text(f"{channel.label}: {', '.join(changes)}")


def _number(value: float | None) -> str:
    return "not measured" if value is None else f"{value:.4g}"
