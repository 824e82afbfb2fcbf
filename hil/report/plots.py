"""The charts of a recording: every channel of a series in a lane of its own, and the validation figure of the paper.

A lane to each channel keeps equal readings from hiding each other. The validation figure is drawn as the paper draws
it: staircase grey and dashed, simulator red, hand blue with markers, so that the traces can be told apart without
colour; the residual of settled samples, in per cent of the channel's range, stands on the right-hand axis.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import THUMB, Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.signals import display_unit, find_steps
from hil.checks.staircase.tracking import residuals
from hil.recordings.recording import Recording
from hil.report.chart import Chart, ChartBox, ChartTrace, Scale, fitted, nice_ticks
from hil.report.chart_svg import sheet_svg

COMMAND, MODEL, HAND, RESIDUAL, FOUND = "#777777", "#c0392b", "#1f4e9c", "#2b2b2b", "#e0a3a3"
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
SIDE_BY_SIDE = Lanes("hand", "Hand and simulator", "", 1.0, 0.0, (("command", COMMAND), ("model", MODEL)), True)


def has_samples(recording: Recording, series: str) -> bool:
    """Return whether a recording has a series, and anything in it: one that was damaged may not."""
    return series in recording.series and recording[series].times.size > 0


def lanes_chart(recording: Recording, lanes: Lanes, marks: Iterable[Mark] = ()) -> Chart:
    """Return a series of seven columns; its least and greatest reading stand at the right of each lane."""
    series = recording[lanes.series]
    least, span = _scales(recording, lanes)
    layers = (*((name, colour) for name, colour in lanes.behind if has_samples(recording, name)), (lanes.series, HAND))
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


def _box(mark: Mark) -> ChartBox:
    row = 0 if mark.channel is None else _row(mark.channel)
    return ChartBox(mark.start, mark.end, row - 0.1, row - 0.1 + (len(Channel) if mark.channel is None else 1), FOUND)


def _row(channel: Channel) -> int:
    """Return the lane of a channel: the first one is on top."""
    return len(Channel) - 1 - channel


def _scales(recording: Recording, lanes: Lanes) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the value at the bottom of each lane and the range of each, (7,) float, in the unit of the lanes."""
    names = [name for name in (lanes.series, *(name for name, _ in lanes.behind)) if has_samples(recording, name)]
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


MARGIN_S = 2.0
"""Time shown on either side of a channel's own sweep; the paper shows five."""
DASHED, DASH_DOTTED = (4.0, 1.8), (7.0, 1.8, 1.2, 1.8)
RESOLVED = (Channel.INDEX, Channel.THUMB_CMC_FLEXION)
"""Channels of which one step is drawn resolved: a finger and a thumb channel."""
THUMB_STYLES = ((MODEL, ()), (HAND, DASHED), (RESIDUAL, DASH_DOTTED))
"""Colour and line of each."""

Draw = Callable[[], Chart]


def sweep_chart(recording: Recording, channel: Channel) -> Chart:
    """Return one channel over its own sweep: command, simulator, hand, and the settled residual on the right."""
    command, hand, model = (recording[name] for name in ("command", "hand", "model"))
    own = [step for step in find_steps(command.times, command.values) if step.channel == channel]
    start, end = own[0].start - MARGIN_S, own[-1].end + MARGIN_S
    unit, scale = display_unit(command.units[channel])
    traces = []
    for series, colour, dashes, label in (
        (command, COMMAND, DASHED, "command"),
        (model, MODEL, (), "simulator"),
        (hand, HAND, DASH_DOTTED, "hand"),
    ):
        inside = (series.times >= start) & (series.times <= end)
        values = scale * series.values[inside, channel]
        traces.append(ChartTrace(series.times[inside], values, colour, dashes, steps=series is command, label=label))
    up = fitted([trace.up for trace in traces], _length_label(unit))
    residual, settled = residuals(recording)
    percent = 100 * residual[:, channel] / np.ptp(command.values[:, channel])
    inside = (hand.times >= start) & (hand.times <= end) & settled[:, channel]
    bound = max(2.0, 1.1 * float(np.abs(percent[inside]).max(initial=0.0)))
    ticks = ((-bound, f"{-bound:.1f}"), (0.0, "0"), (bound, f"{bound:.1f}"))
    dots = ChartTrace(
        hand.times[inside], percent[inside], RESIDUAL, width=0.0, dot=1.2, right=True, label="settled residual"
    )
    return Chart(
        title=channel.title,
        across=fitted([trace.across for trace in traces], "time, s"),
        up=up,
        traces=(*traces, dots),
        right=Scale(-bound, 7 * bound, ticks, "residual, % of range"),  # the lowest quarter of the panel
    )


def step_chart(recording: Recording, channel: Channel) -> Chart:
    """Return one resolved closing step from the middle of a channel's sweep."""
    command, hand, model = (recording[name] for name in ("command", "hand", "model"))
    unit, scale = display_unit(command.units[channel])
    own = [step for step in find_steps(command.times, command.values) if step.channel == channel]
    step = own[len(own) // 4]
    traces = []
    for series, colour, dashes, dot in (
        (command, COMMAND, DASHED, 0.0),
        (model, MODEL, (), 2.0),
        (hand, HAND, DASH_DOTTED, 4.0),
    ):
        inside = (series.times >= step.start - 0.06) & (series.times < step.end)
        times, values = 1e3 * (series.times[inside] - step.start), scale * series.values[inside, channel]
        traces.append(ChartTrace(times, values, colour, dashes, dot=dot, steps=series is command))
    return Chart(
        title=f"One step, {channel.title[0].lower()}{channel.title[1:]}",
        across=fitted([trace.across for trace in traces], "time since the command, ms"),
        up=fitted([trace.up for trace in traces], _length_label(unit)),
        traces=tuple(traces),
    )


def panels(recording: Recording) -> dict[str, Draw]:
    """Return the figure's panels by name, in order: seven sweeps, then the resolved steps."""

    def sweep(channel: Channel) -> Draw:
        return lambda: sweep_chart(recording, channel)

    def step(channel: Channel) -> Draw:
        return lambda: step_chart(recording, channel)

    found = {channel.label: sweep(channel) for channel in Channel}
    return found | {f"step_{channel.label}": step(channel) for channel in RESOLVED}


def thumb_chart(recording: Recording) -> Chart:
    """Return the thumb's three encoders over the coupling sweep."""
    codes = recording["codes"]
    traces = tuple(
        ChartTrace(codes.times, 100.0 * codes.values[:, channel] / MAX_CODE, colour, dashes, label=channel.title)
        for channel, (colour, dashes) in zip(THUMB, THUMB_STYLES, strict=True)
    )
    across, up = fitted([codes.times], "time, s"), fitted([trace.up for trace in traces], "encoder, % of window")
    return Chart(across, up, traces)


def validation_figure(recording: Recording) -> str:
    """Return all panels in one figure, as the text of an SVG file."""
    charts = [draw() for draw in panels(recording).values()]
    return sheet_svg(charts, columns=3, width_inches=13.5, height_inches=9.0)


def _length_label(unit: str) -> str:
    return f"length, {unit}" if unit == "mm" else f"angle, {unit}"
