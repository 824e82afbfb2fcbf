"""Hand less simulator on one staircase, and which samples of it are settled, as the paper defines them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hil.checks.shared.signals import at_times
from hil.recordings.recording import Recording

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

QUIET_COMMAND_S = 0.4
"""A sample is settled when no command has changed for this long ..."""
QUIET_TRACE_S = 0.1
"""... and over this long ..."""
QUIET_TRACE_FRACTION = 0.005
"""... neither trace has moved by more than this part of its range; paper, section "Dynamic validation"."""

_TICK = 1e-6
"""Slack of time comparisons, s: far below a sample, far above rounding."""


def residuals(recording: Recording) -> tuple[Floats, Mask]:
    """Return hand less simulator at the hand's sample times, (n, 7) m or rad, and which samples are settled, (n, 7)."""
    command, hand = recording["command"], recording["hand"]
    model = at_times(recording["model"].times, recording["model"].values, hand.times)
    ranges = np.ptp(command.values, axis=0)
    quiet = quiet_command(command.times, command.values, hand.times)[:, None]
    still = quiet_trace(hand.times, hand.values, ranges) & quiet_trace(hand.times, model, ranges)
    return hand.values - model, quiet & still


def quiet_command(times: Floats, command: Floats, at: Floats) -> Mask:
    """Return at which of the times `at` (m,) no command had changed for `QUIET_COMMAND_S`.

    Args:
        times: (n,) float, s, of the commands.
        command: (n, 7) float; the first row counts as a change.
        at: (m,) float, s.
    """
    changed = np.append(True, np.any(np.diff(command, axis=0) != 0, axis=1))
    last = np.searchsorted(times[changed], at + _TICK, side="right") - 1
    since = np.where(last >= 0, at - times[changed][np.maximum(last, 0)], 0.0)
    return np.asarray(since >= QUIET_COMMAND_S - _TICK)


def quiet_trace(times: Floats, values: Floats, ranges: Floats) -> Mask:
    """Return where each trace stayed within `QUIET_TRACE_FRACTION` of its range over the last `QUIET_TRACE_S`.

    Args:
        times: (n,) float, s.
        values: (n, k) float.
        ranges: (k,) float, unit of the values.

    Returns:
        (n, k) bool; samples earlier than `QUIET_TRACE_S` are judged by what there is.
    """
    low, high = values.copy(), values.copy()
    start = np.searchsorted(times, times - QUIET_TRACE_S - _TICK)
    for back in range(1, int((np.arange(len(times)) - start).max(initial=0)) + 1):
        earlier = np.maximum(np.arange(len(times)) - back, start)
        np.minimum(low, values[earlier], out=low)
        np.maximum(high, values[earlier], out=high)
    return np.asarray(high - low <= QUIET_TRACE_FRACTION * ranges)
