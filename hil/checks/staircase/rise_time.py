"""Response of a trace to one command step: change, 10-90 % rise time, overshoot."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aero.floats import Floats
from hil.checks.shared.signals import CommandStep
from hil.recordings.errors import CannotBeMeasuredError

IN_TIME_S = 0.025
"""Threshold of the gap between two samples, s (1.25 periods of 20 ms); above it a rise is not measured.

Across a longer gap, a rise of 50 ms reads up to 50 % too long.
"""
LEAST_IN_TIME = 0.25
"""Smallest fraction of the steps with samples in time; below it the median resolves only to 10 ms."""
MATCHED_FRACTION = 0.8
"""Smallest fraction of a step that a following trace covers in the step's direction."""


@dataclass(frozen=True)
class Response:
    """Response of a trace to one step."""

    change: float
    """Last sample before `end` minus the sample at `start`, in the trace's unit."""
    rise: float
    """10-90 % time of the change, linear between samples, s; NaN without motion."""
    rise_on_grid: float
    """10-90 % time in whole samples, from the first at or above 10 % to the first at or above 90 %, s."""
    overshoot: float
    """Largest excess over the last sample, as a non-negative fraction of the change; NaN without motion."""
    gap: float = 0.0
    """Longest interval of two samples around the 10 % or 90 % crossing, s."""

    def answers(self, step: CommandStep) -> bool:
        """Return whether the trace followed at least `MATCHED_FRACTION` of the step."""
        asked = step.after - step.before
        return bool(self.change * np.sign(asked) >= MATCHED_FRACTION * abs(asked))


def respond(step: CommandStep, times: Floats, values: Floats) -> Response:
    """Measure the response of a trace to a step.

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
    """Return the median rise of responses sampled in time, s; NaN with too few of them.

    A rise between distant samples reads too long, so late steps of the host are excluded.
    """
    in_time = [answer.rise for answer in answers if answer.gap <= IN_TIME_S]
    return float(np.median(in_time)) if in_time and len(in_time) >= LEAST_IN_TIME * len(answers) else np.nan


def _crossing(t: Floats, progress: Floats, i: int, level: float) -> float:
    """Return the time at which `progress` crosses `level` between samples `i - 1` and `i`, by linear interpolation."""
    part = (level - progress[i - 1]) / (progress[i] - progress[i - 1])
    return float(t[i - 1] + part * (t[i] - t[i - 1]))
