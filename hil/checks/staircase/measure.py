"""Every number of a staircase recording: each channel's tracking, and each cable's load."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import Measured, map_of
from hil.checks.staircase.cable_loads import loads
from hil.checks.staircase.tracking import ChannelMetrics, staircase_metrics
from hil.recordings.recording import Recording


def measure(recording: Recording) -> Measured:
    """Return each channel's row of the validation table, and each cable's take-up, spring load and friction."""
    found = {channel.label: _numbers(row) for channel, row in staircase_metrics(recording).items()}
    ranges = np.ptp(recording["command"].values, axis=0) * 1e3
    spans = map_of(recording.header).window.spans_counts()
    for channel in Channel:
        row = found[channel.label]
        row["settled_percent"] = 100.0 * row["settled_samples"] / len(recording["hand"].times)
        row["resolution"] = resolution(recording["codes"].values[:, channel], int(spans[channel]))
        row["worst_percent"] = 100.0 * abs(row["worst_residual"]) / float(ranges[channel])
    for channel, load in loads(recording).items():
        found[channel.label] |= {"take_up": load.take_up_mm, "spring": load.spring, "friction": load.friction}
    return found


def resolution(codes: NDArray[np.float64], span_counts: int) -> float:
    """Return the coarsest grid, in servo counts, on which nineteen of twenty differences of readings (n,) lie.

    The board reports whole counts of the window; an encoder that has lost its lower bits moves in larger steps.
    """
    counts = np.ceil(np.unique(codes) * span_counts / MAX_CODE - 1e-9)
    steps = np.diff(np.unique(counts))
    return float(np.quantile(steps, 0.05)) if steps.size else np.nan


def _numbers(row: ChannelMetrics) -> dict[str, float]:
    return {name: float(value) for name, value in dataclasses.asdict(row).items() if name != "unit"}
