"""The validation figure as the paper draws it, panel by panel.

Staircase grey and dashed, simulator red, hand blue with markers, so that the traces can be told apart without colour;
the residual of settled samples, in per cent of the channel's range, stands on the right-hand axis.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from aero.channels import THUMB, Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.command_steps import find_steps
from hil.checks.shared.signals import display_unit
from hil.checks.staircase.settled import residuals
from hil.recordings.recording import Recording

MARGIN_S = 2.0
"""Time shown on either side of a channel's own sweep; the paper shows five."""
COMMAND, MODEL, HAND, RESIDUAL = "#777777", "#c0392b", "#1f4e9c", "#2b2b2b"
RESOLVED = (Channel.INDEX, Channel.THUMB_CMC_FLEXION)
"""Channels of which one step is drawn resolved: a finger and a thumb channel."""
THUMB_STYLES = ((MODEL, "-"), (HAND, "--"), (RESIDUAL, "-."))
"""Colour and line of each."""
STYLE: Any = {  # matplotlib types the keys as one literal each
    "font.size": 9,
    "axes.spines.top": False,
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.1,
    "svg.fonttype": "none",
    "svg.hashsalt": "aero-hil",
    "path.simplify_threshold": 0.5,
}

Draw = Callable[[Axes], None]


def draw_sweep(axes: Axes, recording: Recording, channel: Channel) -> None:
    """Draw one channel over its own sweep: command, simulator, hand, and the settled residual on the right."""
    command, hand, model = (recording[name] for name in ("command", "hand", "model"))
    unit, scale = display_unit(command.units[channel])
    own = [step for step in find_steps(command.times, command.values) if step.channel == channel]
    start, end = own[0].start - MARGIN_S, own[-1].end + MARGIN_S

    def window(times: NDArray[np.float64]) -> NDArray[np.bool_]:
        return (times >= start) & (times <= end)

    inside = window(command.times)
    axes.plot(
        command.times[inside], scale * command.values[inside, channel], "--", color=COMMAND, drawstyle="steps-post"
    )
    for series, style, colour in ((model, "-", MODEL), (hand, "-.", HAND)):
        inside = window(series.times)
        axes.plot(series.times[inside], scale * series.values[inside, channel], style, color=colour)
    axes.set_title(channel.title, loc="left", fontsize=10)
    axes.set_xlabel("time, s")
    axes.set_ylabel(f"length, {unit}" if unit == "mm" else f"angle, {unit}")

    residual, settled = residuals(recording)
    percent = 100 * residual[:, channel] / np.ptp(command.values[:, channel])
    inside = window(hand.times) & settled[:, channel]
    right = axes.twinx()
    right.plot(hand.times[inside], percent[inside], ".", color=RESIDUAL, markersize=1.5)
    bound = max(2.0, 1.1 * float(np.abs(percent[inside]).max(initial=0.0)))
    right.set_ylim(-bound, 7 * bound)  # the residual keeps to the lowest quarter of the panel
    right.set_yticks([-bound, 0.0, bound], [f"{-bound:.1f}", "0", f"{bound:.1f}"])
    right.set_ylabel("residual, % of range")
    right.spines["top"].set_visible(False)


def draw_step(axes: Axes, recording: Recording, channel: Channel) -> None:
    """Draw one resolved closing step from the middle of a channel's sweep."""
    command, hand, model = (recording[name] for name in ("command", "hand", "model"))
    unit, scale = display_unit(command.units[channel])
    own = [step for step in find_steps(command.times, command.values) if step.channel == channel]
    step = own[len(own) // 4]
    span = (step.start - 0.06, step.end)
    for series, style, colour, marker in (
        (command, "--", COMMAND, ""),
        (model, "-", MODEL, "."),
        (hand, "-.", HAND, "o"),
    ):
        inside = (series.times >= span[0]) & (series.times < span[1])
        axes.plot(
            1e3 * (series.times[inside] - step.start),
            scale * series.values[inside, channel],
            style,
            color=colour,
            marker=marker,
            markersize=4,
            drawstyle="steps-post" if series is command else "default",
        )
    axes.set_title(f"One step, {channel.title[0].lower()}{channel.title[1:]}", loc="left", fontsize=10)
    axes.set_xlabel("time since the command, ms")
    axes.set_ylabel(f"length, {unit}" if unit == "mm" else f"angle, {unit}")


def panels(recording: Recording) -> dict[str, Draw]:
    """Return the figure's panels by name, in order: seven sweeps, then the resolved steps."""

    def sweep(channel: Channel) -> Draw:
        return lambda axes: draw_sweep(axes, recording, channel)

    def step(channel: Channel) -> Draw:
        return lambda axes: draw_step(axes, recording, channel)

    found = {channel.label: sweep(channel) for channel in Channel}
    return found | {f"step_{channel.label}": step(channel) for channel in RESOLVED}


def draw_thumb(axes: Axes, recording: Recording) -> None:
    """Draw the thumb's three encoders over the coupling sweep."""
    codes = recording["codes"]
    for channel, (colour, style) in zip(THUMB, THUMB_STYLES, strict=True):
        axes.plot(codes.times, 100.0 * codes.values[:, channel] / MAX_CODE, style, color=colour)
    axes.legend([channel.title for channel in THUMB], fontsize=7, framealpha=0.0)
    axes.set_xlabel("time, s")
    axes.set_ylabel("encoder, % of window")


def as_svg(draw: Draw, *, width_inches: float = 4.6, height_inches: float = 2.9) -> str:
    """Draw one panel and return it as an SVG element, text kept as text; the same input gives the same output."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width_inches, height_inches), layout="constrained")
        draw(figure.add_subplot())
        return svg_of(figure)


def svg_of(figure: Figure) -> str:
    """Return a figure as an SVG element; the same figure gives the same text."""
    out = io.StringIO()
    with mpl.rc_context(STYLE):
        figure.savefig(out, format="svg", metadata={"Date": None})
    text = out.getvalue()
    return text[text.index("<svg") :]


def validation_figure(recording: Recording) -> Figure:
    """Return all panels in one figure, for saving as PNG, SVG or PDF."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(13.5, 9), layout="constrained")
        for axes, draw in zip(figure.subplots(3, 3).flat, panels(recording).values(), strict=True):
            draw(axes)
        figure.legend(
            handles=[
                Line2D([], [], color=COMMAND, linestyle="--", label="command"),
                Line2D([], [], color=MODEL, label="simulator"),
                Line2D([], [], color=HAND, linestyle="-.", label="hand"),
                Line2D([], [], color=RESIDUAL, linestyle="", marker=".", label="settled residual"),
            ],
            loc="outside lower center",
            ncols=4,
        )
    return figure
