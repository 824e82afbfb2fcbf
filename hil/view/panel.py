"""Tables beside the drawn hand, as HTML with all text escaped."""

import math
from collections.abc import Sequence

import numpy as np
from jinja2 import Environment, PackageLoader

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.side import Side
from hil.view.frame import CaseStands, FaultOffered, Heading, Moving, Note, Verdicts, ViewFrame
from hil.view.scene import COMMANDED, OTHER, SLACK, TAUT, UNSEEN, Rgb, cable_colour
from simulator.appearance import PULLEY_RGBA

TEMPLATES = Environment(
    loader=PackageLoader("hil.view"), autoescape=True, trim_blocks=True, lstrip_blocks=True, auto_reload=False
)
THUMB_NAMES = {Channel.THUMB_ABDUCTION: "abduction", Channel.THUMB_CMC_FLEXION: "CMC", Channel.THUMB_FLEXOR: "flexor"}
EXCURSION_RAD = ActuationMap().excursion_rad
"""Ends of the bars, (7, 2) rad: range of shaft angles within the joint limits."""
PULLEY: Rgb = (round(255 * PULLEY_RGBA[0]), round(255 * PULLEY_RGBA[1]), round(255 * PULLEY_RGBA[2]))
DIGITS: tuple[tuple[Channel, tuple[int, int, int, int]], ...] = (
    (Channel.PINKY, (34, 62, 34, 20)),
    (Channel.RING, (56, 52, 54, 8)),
    (Channel.MIDDLE, (80, 50, 80, 2)),
    (Channel.INDEX, (104, 54, 108, 10)),
    (Channel.THUMB_ABDUCTION, (104, 112, 122, 96)),
    (Channel.THUMB_CMC_FLEXION, (122, 96, 134, 82)),
    (Channel.THUMB_FLEXOR, (134, 82, 142, 62)),
)
"""Line of each channel on the map of a right hand, palm to the viewer: x, y of both ends, on a 160 by 140 canvas."""
LAST_NOTES = 8
"""Number of events shown, the newest last."""


def title(channel: Channel) -> str:
    """Return a channel's short name."""
    return f"Thumb {THUMB_NAMES[channel]}" if channel in THUMB_NAMES else channel.label.capitalize()


def head(heading: Heading) -> str:
    """Return the page's head: title, layout on a phone, names of the inputs for screen readers."""
    return TEMPLATES.get_template("head.html").render(heading=heading)


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
    """Return the list of findings and of the last events."""
    return TEMPLATES.get_template("found.html").render(verdicts=verdicts, notes=notes[-LAST_NOTES:])


def case(stands: CaseStands, side: Side) -> str:
    """Return the status of a case, with a map of the hand that marks the digits to touch."""
    return TEMPLATES.get_template("case.html").render(
        case=stands, mirrored=side == "left", digits=DIGITS, touched=[Channel(one).title for one in stands.channels]
    )


def moves(text: str) -> str:
    """Return the announcement of a motion."""
    return TEMPLATES.get_template("moves.html").render(text=text)


def progress(moving: Moving) -> str:
    """Return the progress of a motion, with the remaining time."""
    return TEMPLATES.get_template("progress.html").render(moving=moving)


def question(text: str) -> str:
    """Return the text of a question."""
    return TEMPLATES.get_template("question.html").render(text=text)


def lines(told: Sequence[str]) -> str:
    """Return lines for the person at the hand."""
    return TEMPLATES.get_template("lines.html").render(lines=told)


def described(fault: FaultOffered) -> str:
    """Return the description of a fault with its severities."""
    return TEMPLATES.get_template("fault.html").render(words=fault.words, severities=fault.severities)


def _row(frame: ViewFrame, channel: Channel) -> dict[str, object]:
    """Return the table's cells of one channel, None for unknown values, and the `colour` of its cable."""
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
