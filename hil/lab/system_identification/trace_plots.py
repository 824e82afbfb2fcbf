"""Predicted against recorded traces, channel by channel."""

from __future__ import annotations

import io

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.lab.matplotlib_svg import STYLE
from hil.lab.system_identification.trace import Trace
from hil.lab.system_identification.trace_replay import ReplayedTrace

COMMAND, HAND, MODEL = "#777777", "#1f4e9c", "#c0392b"
"""Colours: grey, blue, red."""


def trace_figure(trace: Trace, prediction: ReplayedTrace) -> Figure:
    """Draw seven channels: command grey and dashed, recorded hand blue with dots, prediction red; currents below."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 15.0), layout="constrained")
        axes = figure.subplots(len(Channel), 2, sharex=True)
        goals = trace.codes * trace.spans_counts / MAX_CODE
        for channel, (left, right) in zip(Channel, axes, strict=True):
            left.plot(trace.t_command, goals[:, channel], "--", color=COMMAND, drawstyle="steps-post", label="command")
            left.plot(trace.t_read, trace.counts[:, channel], ".-", color=HAND, markersize=3, label="recorded")
            left.plot(trace.t_read, prediction.counts[:, channel], "-", color=MODEL, label="predicted")
            right.plot(trace.t_read, trace.currents[:, channel], ".-", color=HAND, markersize=3)
            right.plot(trace.t_read, prediction.currents[:, channel], "-", color=MODEL)
            error = np.sqrt(np.mean((prediction.counts - trace.counts)[:, channel] ** 2))
            left.set_ylabel("counts")
            left.set_title(f"{channel.title}, {error:.1f} counts rms", loc="left")
            right.set_ylabel("A")
        axes[0, 0].legend(loc="best", frameon=False)
        for axis in axes[-1]:
            axis.set_xlabel("s")
        figure.suptitle(trace.name)
    return figure


def trace_svg(trace: Trace, prediction: ReplayedTrace) -> str:
    """Return `trace_figure` as SVG text."""
    with mpl.rc_context(STYLE):
        text = io.StringIO()
        trace_figure(trace, prediction).savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()
