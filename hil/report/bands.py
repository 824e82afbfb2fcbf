"""Limit bands in the plots: permitted ranges of the readings that a plot over time shows as they are."""

import math
from dataclasses import replace

from hil.checks import metric_of
from hil.checks.shared.subjects import CHANNELS
from hil.report.plots import Band, Plot
from hil.verdict.judged_run import Validation
from hil.verdict.limits import load_limits


def banded(plot: Plot, validation: Validation) -> Plot:
    """Return a plot with the limit bands of its experiment."""
    header = validation.header
    if header is None:
        return plot
    limits = load_limits(header.firmware, guarded=bool(header.safety))
    bands = (
        Band(metric.plotted, CHANNELS.index(subject), _finite(one.at_least), _finite(one.at_most), metric.words)
        for one in limits
        if one.experiment == plot.experiment
        for subject in one.subjects
        if subject in CHANNELS
        and (metric := metric_of(one.experiment, one.metric, subject)) is not None
        and metric.plotted in plot.rows
    )
    return replace(plot, bands=tuple(bands))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
