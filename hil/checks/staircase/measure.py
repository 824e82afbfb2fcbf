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
    """Return each channel's row of the validation table, and each cable's take-up, spring load and friction.

    The rise of a channel is withheld where the host was late in most of its steps.
    """
    found = {channel.label: channel_numbers(row) for channel, row in staircase_metrics(recording).items()}
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


def channel_numbers(row: ChannelMetrics) -> dict[str, float]:
    """Return a row's numbers by metric, without the rise where the host was too late to tell it."""
    host_was_late = row.matched_steps > 0 and np.isnan(row.rise_hand_ms)
    left_out = {"unit", "rise_hand_ms"} if host_was_late else {"unit"}
    return {name: float(value) for name, value in dataclasses.asdict(row).items() if name not in left_out}
