"""All seven channels of one series against time, each in a lane of its own, so that equal readings do not hide."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.signals import display_unit
from hil.recordings.recording import Recording
from hil.report.chart import Box, Chart, ChartTrace, Scale, nice_ticks

COMMAND, READING, SIMULATOR, FOUND = "#777777", "#1f4e9c", "#c0392b", "#e0a3a3"
"""Colours that the page replaces by its own, which follow the reader's light or dark style."""
HEIGHT = 0.8
"""Of a lane's data; lanes are 1 apart."""


@dataclass(frozen=True)
class Mark:
    """A stretch of one channel's lane that a finding points at; of every lane when the channel is None."""

    channel: Channel | None
    start: float
    """s"""
    end: float


@dataclass(frozen=True)
class Lanes:
    """What is drawn of a recording, and what it means."""

    series: str
    title: str
    unit: str
    scale: float = 1.0
    """From the series to `unit`."""
    least_range: float = 0.0
    """Range of a lane at least, in `unit`, so that noise does not fill it."""
    behind: tuple[tuple[str, str], ...] = ()
    """Series drawn behind it, with their colours."""
    own_scale: bool = False
    """Whether each lane has a scale of its own: lengths and an angle have no common one."""


POSITIONS = Lanes("codes", "Positions", "% of window", 100.0 / MAX_CODE, 100.0, (("command_codes", COMMAND),))
CURRENTS = Lanes("currents", "Currents", "A", 1.0, 0.5)
TEMPERATURES = Lanes("temperatures", "Temperatures", "\u00b0C", 1.0, 4.0)
SIDE_BY_SIDE = Lanes("hand", "Hand and simulator", "", 1.0, 0.0, (("command", COMMAND), ("model", SIMULATOR)), True)


def lanes_chart(recording: Recording, lanes: Lanes, marks: Iterable[Mark] = ()) -> Chart:
    """Return a series of seven columns; its least and greatest reading stand at the right of each lane."""
    series = recording[lanes.series]
    least, span = _scales(recording, lanes)
    layers = (*((name, colour) for name, colour in lanes.behind if name in recording.series), (lanes.series, READING))
    traces = [
        ChartTrace(
            recording[name].times,
            _row(channel)
            + HEIGHT * (lanes.scale * recording[name].values[:, channel] - least[channel]) / span[channel],
            colour,
            width=0.9,
            steps=name not in ("hand", "model"),
        )
        for name, colour in layers
        for channel in Channel
    ]
    end = max(float(series.times[-1]), 1e-3)
    names = tuple((_row(channel) + HEIGHT / 2, channel.label.replace("_", " ")) for channel in Channel)
    ranges = tuple((_row(channel) + HEIGHT / 2, _range(recording, lanes, channel)) for channel in Channel)
    return Chart(
        across=Scale(0.0, end, nice_ticks(0.0, end), "time, s"),
        up=Scale(-0.15, len(Channel), names, line=False),
        traces=tuple(traces),
        right=Scale(-0.15, len(Channel), ranges, line=False),
        boxes=tuple(_box(mark) for mark in marks),
    )


def _box(mark: Mark) -> Box:
    row = 0 if mark.channel is None else _row(mark.channel)
    return Box(mark.start, mark.end, row - 0.1, row - 0.1 + (len(Channel) if mark.channel is None else 1), FOUND)


def _row(channel: Channel) -> int:
    """Return the lane of a channel: the first one is on top."""
    return len(Channel) - 1 - channel


def _scales(recording: Recording, lanes: Lanes) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the value at the bottom of each lane and the range of each, (7,) float, in the unit of the lanes."""
    names = [name for name in (lanes.series, *(name for name, _ in lanes.behind)) if name in recording.series]
    values = [lanes.scale * recording[name].values for name in names]
    least = np.min([rows.min(axis=0) for rows in values], axis=0)
    most = np.max([rows.max(axis=0) for rows in values], axis=0)
    if not lanes.own_scale:
        least, most = np.full_like(least, least.min()), np.full_like(most, most.max())
    return least, np.maximum(most - least, max(lanes.least_range, 1e-9))


def _range(recording: Recording, lanes: Lanes, channel: Channel) -> str:
    series = recording[lanes.series]
    unit, scale = display_unit(series.units[channel]) if lanes.own_scale else (lanes.unit, lanes.scale)
    values = scale * series.values[:, channel]
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    if unit.startswith("%"):
        unit, low, high = "%", f"{values.min():.0f}", f"{values.max():.0f}"
    return f"{low} {unit}" if low == high else f"{low} \u2013 {high} {unit}"
