"""What was measured beside what the paper published, each with its limit and with the reason for a difference."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from aero.channels import Channel
from hil.checks.shared.subjects import CHANNELS
from hil.checks.staircase.tracking import ChannelMetrics
from hil.report.differences import reason, why
from hil.report.plots import title
from hil.verdict.findings import Finding
from hil.verdict.judged_run import Validation
from hil.verdict.paper_figures import PAPER, PAPER_TEXT, PaperFigure


@dataclass(frozen=True)
class Cell:
    """A measured number beside the paper's, both as text."""

    name: str
    short: str
    """Name for a narrow column."""
    ours: str
    paper: str
    limit: str
    failed: bool = False
    why: str = ""
    """Why it may differ from the paper's; empty when it hardly does, or when it failed and a finding says more."""


@dataclass(frozen=True)
class Row:
    """One channel's line of the table."""

    title: str
    unit: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Note:
    """One reason why figures differ from the paper's, and which."""

    number: int
    figure: str
    channels: str
    reason: str


def notes(rows: Iterable[Row]) -> list[Note]:
    """Return each reason that stands in a table once, numbered in the order of the columns."""
    found: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        for cell in row.cells:
            if cell.why:
                found.setdefault((cell.name.removesuffix(", ms"), cell.why), []).append(row.title)
    return [
        Note(number, figure, ", ".join(channels), why)
        for number, ((figure, why), channels) in enumerate(found.items(), start=1)
    ]


@dataclass(frozen=True)
class TextRow:
    """A number of the paper's text beside ours."""

    name: str
    paper: str
    model: str
    ours: str
    limit: str
    note: str


def table(metrics: Mapping[Channel, ChannelMetrics], findings: Iterable[Finding] = ()) -> tuple[Row, ...]:
    """Return the validation table, one row a channel, each number beside the paper's and its limit."""
    judged = {(finding.check, finding.subject): finding for finding in findings}
    return tuple(_row(channel, row, judged) for channel, row in metrics.items())


def text_rows(validation: Validation) -> list[TextRow]:
    """Return the figures of the paper's text that were measured, or that cannot be."""
    return [_text_row(figure, validation) for figure in PAPER_TEXT if _shown(figure, validation)]


def _shown(figure: PaperFigure, validation: Validation) -> bool:
    """Whether there is a number, or a reason why there is none, to show beside the paper's."""
    return not figure.experiment or validation.measured(figure.experiment) is not None


def _text_row(figure: PaperFigure, validation: Validation) -> TextRow:
    if not figure.experiment:
        return TextRow(figure.name, figure.paper, "", "not measured", "", figure.note)
    result = validation.results[figure.experiment]
    ours = f"{result.measured[figure.subject][figure.metric]:.4g} {figure.unit}"
    model = f"{result.measured[figure.subject][figure.model]:.4g} {figure.unit}" if figure.model else ""
    limits = {(finding.check, finding.subject): finding.expected for finding in result.findings}
    limit = limits.get((figure.metric, figure.subject), "none")
    known = reason(figure.metric, Channel(CHANNELS.index(figure.subject))) if figure.subject in CHANNELS else ""
    return TextRow(figure.name, figure.paper, model, ours, limit, known or figure.note)


def _row(channel: Channel, row: ChannelMetrics, judged: Mapping[tuple[str, str], Finding]) -> Row:
    paper = PAPER[channel]
    cells = (
        ("Excursion, simulator", "model\nspan", "excursion_model", 2, None),
        ("Excursion, hand", "hand\nspan", "excursion_hand", 2, paper.excursion_hand),
        ("Tracking RMS", "RMS", "tracking_rms", 2, paper.tracking_rms),
        ("Rise, simulator, ms", "model\nrise", "rise_model_ms", 0, paper.rise_model_ms),
        ("Rise, hand, ms", "hand\nrise", "rise_hand_ms", 0, paper.rise_hand_ms),
        ("Overshoot, hand, %", "over\n%", "overshoot_hand_percent", 1, 0.0),
        ("Settled samples", "settled", "settled_samples", 0, None),
        ("Matched steps", "steps", "matched_steps", 0, None),
    )

    def cell(name: str, short: str, metric: str, digits: int, published: float | None) -> Cell:
        ours, finding = getattr(row, metric), judged.get((metric, channel.label))
        failed = finding is not None and not finding.passed
        return Cell(
            name,
            short,
            _number(ours, digits),
            "" if published is None else _number(published, digits),
            "" if finding is None else finding.expected,
            failed,
            "" if failed else why(metric, channel, ours, published),
        )

    return Row(title(channel), row.unit, tuple(cell(*columns) for columns in cells))


def _number(value: float, digits: int) -> str:
    return "none" if math.isnan(value) else f"{value:.{digits}f}"
