"""The tables beside the drawn hand, as HTML; whatever comes from a recording is escaped."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jinja2 import Environment, PackageLoader

from aero.actuation import ActuationMap
from aero.channels import Channel
from hil.faults.catalogue import severities
from hil.faults.fault import Fault
from hil.view.frame import Heading, Note, Verdicts, ViewFrame
from hil.view.scene import COMMANDED, OTHER, SLACK, TAUT, UNSEEN, Rgb, cable_colour
from model.appearance import PULLEY_RGBA

TEMPLATES = Environment(
    loader=PackageLoader("hil.view"), autoescape=True, trim_blocks=True, lstrip_blocks=True, auto_reload=False
)
THUMB_NAMES = {Channel.THUMB_ABDUCTION: "abduction", Channel.THUMB_CMC_FLEXION: "CMC", Channel.THUMB_FLEXOR: "flexor"}
EXCURSION_RAD = ActuationMap().excursion_rad
"""Ends of the bars, (7, 2) rad: the shaft angles that the joint box allows."""
PULLEY: Rgb = (round(255 * PULLEY_RGBA[0]), round(255 * PULLEY_RGBA[1]), round(255 * PULLEY_RGBA[2]))
LAST_NOTES = 8
"""Events that are shown, the newest last."""


def title(channel: Channel) -> str:
    """Return a channel's short name."""
    return f"Thumb {THUMB_NAMES[channel]}" if channel in THUMB_NAMES else channel.label.capitalize()


def head(heading: Heading) -> str:
    """Return what the page has in its head: title, layout on a phone, names of the inputs for screen readers."""
    return TEMPLATES.get_template("head.html").render(title=heading.title)


def numbers(heading: Heading, frame: ViewFrame, state: str) -> str:
    """Return the table of all channels at one instant, with the legend of the drawn hand."""
    legend = [(TAUT, "taut cable"), (SLACK, "slack cable"), (UNSEEN, "cable, tension not known")]
    known = bool(np.isfinite(frame.loose).any())
    shown = [*(legend[:2] if known else legend[2:]), (OTHER, "spring, coupling")]
    shown += [(PULLEY, "pulley"), (COMMANDED, "commanded posture")]
    return TEMPLATES.get_template("panel.html").render(
        heading=heading,
        frame=frame,
        state=state,
        rows=[_row(frame, channel) for channel in Channel],
        commanded_colour=_css(COMMANDED),
        legend=[(_css(colour), meaning) for colour, meaning in shown],
    )


def found(verdicts: Verdicts | None, notes: Sequence[Note]) -> str:
    """Return findings and the last events."""
    return TEMPLATES.get_template("found.html").render(verdicts=verdicts, notes=notes[-LAST_NOTES:])


def described(fault: Fault) -> str:
    """Return what a fault is, and its severities."""
    return TEMPLATES.get_template("fault.html").render(words=fault.words, severities=severities(fault))


def _row(frame: ViewFrame, channel: Channel) -> dict[str, object]:
    """Return what the table has of one channel; None for what is not known, and `colour` of its cable."""
    loose = float(frame.loose[channel])
    slack = cable_colour(loose) == SLACK
    low, high = EXCURSION_RAD[channel]
    row: dict[str, object] = {
        "title": title(channel),
        "colour": None if math.isnan(loose) else _css(cable_colour(loose)),
    }
    for name, value, form in (
        ("commanded", np.rad2deg(frame.commanded[channel]), "{:z.1f}°"),
        ("measured", np.rad2deg(frame.measured[channel]), "{:z.1f}°"),
        ("mark", 100.0 * np.clip((frame.commanded[channel] - low) / (high - low), 0.0, 1.0), "{:.1f}%"),
        ("filled", 100.0 * np.clip((frame.measured[channel] - low) / (high - low), 0.0, 1.0), "{:.1f}%"),
        ("current", frame.currents[channel], "{:.2f} A"),
        ("temperature", frame.temperatures[channel], "{:.0f} °C"),
        ("cable", 1e3 * loose if slack else frame.tensions[channel], "{:.1f} mm" if slack else "{:.1f} N"),
    ):
        row[name] = None if math.isnan(value) else form.format(value)
    return row


def _css(colour: Rgb) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)
