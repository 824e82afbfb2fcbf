"""The validation figure as the paper draws it, panel by panel.

Staircase grey and dashed, simulator red, hand blue with markers, so that the traces can be told apart without colour;
the residual of settled samples, in per cent of the channel's range, stands on the right-hand axis.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aero.channels import THUMB, Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.signals import display_unit, find_steps
from hil.checks.staircase.tracking import residuals
from hil.recordings.recording import Recording
from hil.report.chart import Chart, ChartTrace, Scale, fitted
from hil.report.chart_svg import sheet_svg

MARGIN_S = 2.0
"""Time shown on either side of a channel's own sweep; the paper shows five."""
COMMAND, MODEL, HAND, RESIDUAL = "#777777", "#c0392b", "#1f4e9c", "#2b2b2b"
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
