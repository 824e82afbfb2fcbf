"""How a trace answers one command step: its change, its 10-90 % rise time, its overshoot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil.checks.shared.signals import CommandStep
from hil.recordings.errors import CannotBeMeasuredError

Floats = NDArray[np.float64]

IN_TIME_S = 0.025
"""Longest gap between two samples across which a rise is measured, s: 1.25 periods of 20 ms. Across a longer gap a rise
of 50 ms reads up to 50 % too long."""
LEAST_IN_TIME = 0.25
"""Least fraction of the steps that must be sampled in time; fewer resolve their median to 10 ms only."""
MATCHED_FRACTION = 0.8
"""Least fraction of a step that the trace must cover, in its direction, to count as answered."""


@dataclass(frozen=True)
class Response:
    """A trace's answer to one step."""

    change: float
    """Last sample before `end` less the sample at `start`, in the trace's unit."""
    rise: float
    """10-90 % time of that change, linear between samples, s; NaN when the trace did not move."""
    rise_on_grid: float
    """The same from the first sample at or above 10 % to the first at or above 90 %, s: a whole number of samples."""
    overshoot: float
    """Greatest excess over the last sample, as a part of the change, not negative; NaN when it did not move."""
    gap: float = 0.0
    """Longest time between the two samples on either side of 10 %, or of 90 %, s."""

    def answers(self, step: CommandStep) -> bool:
        """Whether the trace followed the step by at least `MATCHED_FRACTION` of it."""
        asked = step.after - step.before
        return bool(self.change * np.sign(asked) >= MATCHED_FRACTION * abs(asked))


def respond(step: CommandStep, times: Floats, values: Floats) -> Response:
    """Measure how a trace answers a step.

    Args:
        step: the step.
        times: (n,) float, s, increasing.
        values: (n,) float, the trace of the step's channel in any unit.

    Raises:
        CannotBeMeasuredError: the trace has fewer than two samples between the step and its end.
    """
    first = max(0, int(np.searchsorted(times, step.start, side="right")) - 1)
    last = int(np.searchsorted(times, step.end, side="left"))
    if last - first < 2:
        raise CannotBeMeasuredError(
            f"no samples between {step.start:.3f} s and {step.end:.3f} s; was the recording cut short?"
        )
    t, v = times[first:last], values[first:last]
    change = float(v[-1] - v[0])
    if change == 0.0:
        return Response(0.0, np.nan, np.nan, np.nan)
    progress = (v - v[0]) / change
    low, high = int(np.argmax(progress >= 0.1)), int(np.argmax(progress >= 0.9))
    rise = _crossing(t, progress, high, 0.9) - _crossing(t, progress, low, 0.1)
    gap = max(float(t[i] - t[i - 1]) for i in (low, high))
    return Response(change, rise, float(t[high] - t[low]), max(0.0, float(progress.max()) - 1.0), gap)


def median_rise(answers: Sequence[Response]) -> float:
    """Return the median rise of some answers that were sampled in time, s; NaN without any, or with too few of them.

    Between samples that lie far apart a rise reads too long. So of a host that is late in some steps the others count.
    """
    in_time = [answer.rise for answer in answers if answer.gap <= IN_TIME_S]
    return float(np.median(in_time)) if in_time and len(in_time) >= LEAST_IN_TIME * len(answers) else np.nan


def _crossing(t: Floats, progress: Floats, i: int, level: float) -> float:
    """Return when `progress` crosses `level` on its way from sample `i - 1` to sample `i`, linear in between."""
    part = (level - progress[i - 1]) / (progress[i] - progress[i - 1])
    return float(t[i - 1] + part * (t[i] - t[i - 1]))
