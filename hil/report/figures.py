"""The figures of a report: which panels an experiment has, what each means, and colours that follow the reader."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from aero.channels import Channel
from hil.checks import EXPERIMENTS
from hil.recordings.recording import Recording
from hil.report.chart import Chart
from hil.report.chart_svg import INK, chart_svg
from hil.report.evidence import figure_name
from hil.report.plots import (
    COMMAND,
    CURRENTS,
    FOUND,
    HAND,
    MODEL,
    POSITIONS,
    RESIDUAL,
    SIDE_BY_SIDE,
    TEMPERATURES,
    Lanes,
    Mark,
    has_samples,
    lanes_chart,
    panels,
    thumb_chart,
)

COLOURS = {
    INK: "ink",
    COMMAND: "command",
    MODEL: "simulator",
    HAND: "reading",
    RESIDUAL: "residual",
    FOUND: "found",
}
"""Colour in a figure to the page's variable for it."""
BACKGROUND = re.compile(r"fill: #ffffff")
LANES_INCHES = 3.4


@dataclass(frozen=True)
class Panel:
    """One figure that can be drawn, and what it means."""

    title: str
    meaning: str
    draw: Callable[[], Chart]
    height_inches: float = 2.9


@dataclass(frozen=True)
class Drawn:
    """One figure of the page."""

    name: str
    """Unique on the page; what links point at."""
    title: str
    meaning: str
    svg: str


MEANINGS = {
    POSITIONS: "What each encoder reads, and in grey what was commanded. A lane that stays flat did not follow.",
    CURRENTS: (
        "What each servo says it draws; the sign is the way its motor turns. A loose or torn cable draws next to none."
    ),
    TEMPERATURES: "Whole degrees, as each servo reports them. All should rise alike, and slowly.",
    SIDE_BY_SIDE: (
        "One stream (grey) on simulator (red) and hand (blue). The shapes should agree; a shift to the right is delay."
    ),
}
SWEEP = (
    "The channel's own climb and descent. Hand and simulator should lie on each other; dots are the settled residual."
)
STEP = "One step at full resolution, a mark a sample: delay, slope and overshoot of simulator and hand."
ABDUCTION_NOTE = (
    "CMC flexion closed at none, half and full abduction. Without abduction the palm stops it half way; with "
    "abduction it passes the palm."
)
LANES: dict[str, Lanes] = {
    "positions": POSITIONS,
    "currents": CURRENTS,
    "temperatures": TEMPERATURES,
    "side_by_side": SIDE_BY_SIDE,
}
"""Drawings that show one series of all seven channels, by the name that a check's `drawn` gives them."""


def _sweeps(recording: Recording) -> dict[str, Panel]:
    return {
        name: Panel(_title(name), STEP if name.startswith("step_") else SWEEP, draw)
        for name, draw in panels(recording).items()
    }


def _thumb(recording: Recording) -> dict[str, Panel]:
    return {"codes": Panel("Thumb", ABDUCTION_NOTE, partial(thumb_chart, recording))}


PANELS: dict[str, Callable[[Recording], dict[str, Panel]]] = {"sweeps": _sweeps, "thumb": _thumb}
"""The other drawings: name to the panels of a recording."""


def figures_of(experiment: str, recording: Recording, marks: Iterable[tuple[str, Mark]] = ()) -> list[Drawn]:
    """Draw the figures that an experiment declares, of one that ran to its end.

    Args:
        experiment: its name.
        recording: what it left.
        marks: name of a figure, and what to mark in it.
    """
    found: dict[str, Panel] = {}
    marked = tuple(marks)
    for drawing in EXPERIMENTS[experiment].drawn:
        if drawing in PANELS:
            found |= PANELS[drawing](recording)
        elif has_samples(recording, (kind := LANES[drawing]).series):
            own = [mark for name, mark in marked if name == figure_name(experiment, kind.series)]
            found[kind.series] = _lanes_panel(kind, recording, own)
    return [_drawn(experiment, name, panel) for name, panel in found.items()]


def traces_of(recording: Recording) -> list[Drawn]:
    """Draw what an experiment that was broken off had recorded until then."""
    return [
        _drawn(f"broken-{recording.header.experiment}", kind.series, _lanes_panel(kind, recording))
        for kind in LANES.values()
        if has_samples(recording, kind.series)
    ]


def themed(svg: str) -> str:
    """Return a figure whose colours follow the page's, light or dark; a colour the page does not name stays."""
    for colour, variable in COLOURS.items():
        svg = svg.replace(f": {colour}", f": var(--{variable}, {colour})")
    return BACKGROUND.sub("fill: none", svg)


def _lanes_panel(kind: Lanes, recording: Recording, marks: Iterable[Mark] = ()) -> Panel:
    draw = partial(lanes_chart, recording, kind, tuple(marks))
    return Panel(f"{kind.title}, all seven", MEANINGS[kind], draw, LANES_INCHES)


def _drawn(experiment: str, name: str, panel: Panel) -> Drawn:
    svg = themed(chart_svg(panel.draw(), height_inches=panel.height_inches))
    return Drawn(figure_name(experiment, name), panel.title, panel.meaning, svg)


def _title(name: str) -> str:
    step, _, channel = name.rpartition("step_")
    return ("One step, " if step or name.startswith("step_") else "") + Channel[channel.upper()].title
