"""One self-contained HTML page about one recording: verdict first, then why, then everything it rests on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined

from aero.channels import Channel
from hil.findings import Finding, failed
from hil.metrics import ChannelMetrics
from hil.plots import as_svg, panels, title
from hil.recording import Recording
from hil.reference import PAPER
from hil.residuals import Attribution


@dataclass(frozen=True)
class Cell:
    """A measured number beside the paper's, both as text."""

    name: str
    short: str
    """Name for a narrow column."""
    ours: str
    paper: str = ""


@dataclass(frozen=True)
class Row:
    """One channel's line of the table."""

    title: str
    unit: str
    cells: tuple[Cell, ...]


def table(metrics: Mapping[Channel, ChannelMetrics]) -> tuple[Row, ...]:
    """Return the validation table, one row a channel, each number beside the paper's."""
    return tuple(_row(channel, row) for channel, row in metrics.items())


def render_report(
    recording: Recording,
    metrics: Mapping[Channel, ChannelMetrics],
    findings: Sequence[Finding],
    attributions: Mapping[Channel, Attribution],
    *,
    wall_seconds: float,
) -> str:
    """Return the page for a staircase recording; it loads nothing from anywhere."""
    environment = Environment(
        loader=PackageLoader(__name__), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template("report.html.j2").render(
        header=recording.header,
        hand_seconds=recording["hand"].times[-1],
        wall_seconds=wall_seconds,
        findings=findings,
        failures=failed(findings),
        rows=table(metrics),
        causes=[(title(channel), row, attributions[channel]) for channel, row in metrics.items()],
        figures={name: as_svg(draw) for name, draw in panels(recording).items()},
        events=recording.events,
        title=title,
    )


def _row(channel: Channel, row: ChannelMetrics) -> Row:
    paper = PAPER[channel]
    return Row(
        title(channel),
        row.unit,
        (
            Cell("Excursion, simulator", "model\nspan", _number(row.excursion_model)),
            Cell("Excursion, hand", "hand\nspan", _number(row.excursion_hand), _number(paper.excursion_hand)),
            Cell("Tracking RMS", "RMS", _number(row.tracking_rms), _number(paper.tracking_rms)),
            Cell("Rise, simulator, ms", "model\nrise", _number(row.rise_model_ms, 0), _number(paper.rise_model_ms, 0)),
            Cell("Rise, hand, ms", "hand\nrise", _number(row.rise_hand_ms, 0), _number(paper.rise_hand_ms, 0)),
            Cell("Overshoot, hand, %", "over\n%", _number(row.overshoot_hand_percent, 1), "0"),
            Cell("Settled samples", "settled", str(row.settled_samples)),
            Cell("Matched steps", "steps", str(row.matched_steps), "72-177"),
        ),
    )


def _number(value: float, digits: int = 2) -> str:
    return "none" if math.isnan(value) else f"{value:.{digits}f}"
