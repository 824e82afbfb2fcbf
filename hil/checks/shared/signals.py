"""Operations on sampled signals and command steps, shared by the experiments."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from aero.channels import Channel
from aero.floats import Floats
from aero.side import Side
from hil.recordings.recording import Series

MILLI = 1e3
"""Factor from m and rad to the displayed mm and mrad."""


def at_times(times: Floats, values: Floats, at: Floats) -> Floats:
    """Return each column of `values` (n, k), linearly interpolated at the times `at`, (m, k)."""
    return np.stack([np.interp(at, times, column) for column in values.T], axis=1)


def in_force(commands: Series, at: Floats) -> Floats:
    """Return the commands (m, k) in force at the times `at` (m,)."""
    rows = np.maximum(np.searchsorted(commands.times, at, side="right") - 1, 0)
    found: Floats = commands.values[rows]
    return found


def rms(values: Floats) -> float:
    """Return the root mean square; NaN for an empty array."""
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else np.nan


@dataclass(frozen=True)
class CommandStep:
    """Change of one channel's command, and the time until the next change of any command."""

    channel: int
    start: float
    """Time of the change, s."""
    end: float
    """Time of the next change of any channel, or of the last sample, s."""
    before: float
    after: float


def find_steps(times: Floats, command: Floats) -> list[CommandStep]:
    """Return every step of a command stream.

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


def own_stretch(steps: Iterable[CommandStep], channel: int) -> tuple[float, float] | None:
    """Return start and end (s) of the first interval that commands only this channel; None without a step."""
    stretch: list[CommandStep] = []
    for step in steps:
        if step.channel == channel:
            stretch.append(step)
        elif stretch:
            break
    return (stretch[0].start, stretch[-1].end) if stretch else None


# Signs from the mechanism alone, independent of map, window and measurements, so that a check can test the map with
# them. Every servo of a right hand except the flexor's closes its channel by turning towards lower counts; a left hand
# is mirrored. A positive current pulls towards lower counts. Source: mounting of the servos (`aero-open-firmware`
# d7bd82e) and the public logs of June-July 2026 (TTdragoAlex/tetherIA-aero-hand-open 58b518e).
def closing_current(currents: Floats, side: Side) -> Floats:
    """Return currents with the sign of their effect: positive closes the channel.

    Args:
        currents: (..., 7) as read, A.
        side: `right` or `left`.
    """
    signs = np.ones(len(Channel))
    signs[Channel.THUMB_FLEXOR] = -1.0
    return currents * (signs if side == "right" else -signs)
