"""The single steps of a command stream."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CommandStep:
    """One change of one channel's command, and the time until any command changes again."""

    channel: int
    start: float
    """Time of the change, s."""
    end: float
    """Time of the next change of any channel, or of the last sample, s."""
    before: float
    after: float


def find_steps(times: Floats, command: Floats) -> list[CommandStep]:
    """Find every step of a command stream.

    Args:
        times: (n,) float, s.
        command: (n, 7) float; a row holds from its time to the next.

    Returns:
        The steps in order of time; two channels that change at once give two steps.
    """
    rows, channels = np.nonzero(np.diff(command, axis=0))
    changes = np.append(np.unique(times[rows + 1]), times[-1])
    return [
        CommandStep(
            channel=int(channel),
            start=float(times[row + 1]),
            end=float(changes[np.searchsorted(changes, times[row + 1], side="right").clip(max=len(changes) - 1)]),
            before=float(command[row, channel]),
            after=float(command[row + 1, channel]),
        )
        for row, channel in zip(rows, channels, strict=True)
    ]
