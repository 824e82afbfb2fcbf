"""What was measured beside what the paper published, each with its limit and with the reason for a difference."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from importlib import resources

from aero.channels import Channel
from hil.checks import EXPERIMENTS
from hil.checks.shared.declaration import Metric, Published
from hil.checks.shared.experiment import reading
from hil.checks.shared.subjects import FINGERS
from hil.recordings.series_layout import LENGTH_UNITS
from hil.verdict.findings import Finding
from hil.verdict.judged_run import Result, Validation

EXCURSION = EXPERIMENTS["excursion"]
MARK = "\u2020"
"""Stands at a number of the paper that measures something else."""
MARKED = (
    f"{MARK} Another quantity: the thumb is swept alone through its whole window here, and goes to a fist in the paper."
)
SPANS = ("excursion_model", "excursion_hand")
"""Metrics that are of a sweep here, and of a fist in the paper."""


@dataclass(frozen=True)
class Cell:
    """A measured number beside the paper's, both as text."""

    name: str
    ours: str
    paper: str
    """With `MARK` where it is of another quantity."""
    limit: str
    failed: bool = False


@dataclass(frozen=True)
class PaperRow:
    """One channel's line of the table."""

    title: str
    unit: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class TextRow:
    """A number of the paper's text beside ours."""

    name: str
    paper: str
    model: str
    ours: str
    limit: str
    note: str


def compared(validation: Validation) -> Result | None:
    """Return what stands in a table beside the paper's, None when nothing of the kind was measured."""
    return next(
        (result for name, result in validation.results.items() if result.measured and EXPERIMENTS[name].columns), None
    )


def table(result: Result) -> tuple[PaperRow, ...]:
    """Return the columns that an experiment declares, a row a channel: each number beside the paper's and its limit."""
    judged = {(finding.check, finding.subject): finding for finding in result.findings}
    measuring = EXPERIMENTS[result.recording.header.experiment]
    rows = []
    for channel in Channel:
        cells = []
        for column in measuring.columns:
            metric = measuring.metric(column.name, channel.label)
            value = reading(result.measured, channel.label, metric.name)
            cells.append(_cell(metric, channel.label, value, judged.get((metric.name, channel.label))))
        rows.append(PaperRow(channel.title, length_unit(channel), tuple(cells)))
    return tuple(rows)


def reasons(result: Result) -> dict[tuple[str, str], list[str]]:
    """Return why a column may differ from the paper's, each column and reason once, to the channels it is about."""
    measuring = EXPERIMENTS[result.recording.header.experiment]
    found: dict[tuple[str, str], list[str]] = {}
    for column in measuring.columns:
        for channel in Channel:
            metric = measuring.metric(column.name, channel.label)
            if metric.column is not None and metric.differs:
                found.setdefault((metric.column.title.removesuffix(", ms"), metric.differs), []).append(channel.title)
    return found


def length_unit(channel: Channel) -> str:
    """Return the unit of a channel's lengths: mm, or mrad for the abduction."""
    return f"m{LENGTH_UNITS[channel]}"


def text_rows(validation: Validation) -> list[TextRow]:
    """Return the figures of the paper's text that were measured, and those that cannot be."""
    measured = [
        _text_row(figure, metric, name, validation)
        for name, measuring in EXPERIMENTS.items()
        if validation.measured(name) is not None
        for metric in measuring.metrics
        for figure in metric.published
    ]
    text = (resources.files("hil.checks") / "unmeasured.toml").read_text(encoding="utf-8")
    unmeasured = tomllib.loads(text)["figure"]
    return measured + [TextRow(row["figure"], row["says"], "", "not measured", "", row["note"]) for row in unmeasured]


def _text_row(figure: Published, metric: Metric, experiment: str, validation: Validation) -> TextRow:
    result = validation.results[experiment]
    ours = metric.text(reading(result.measured, figure.subject, metric.name))
    model = metric.text(reading(result.measured, figure.subject, figure.model)) if figure.model else ""
    limits = {(finding.check, finding.subject): finding.expected for finding in result.findings}
    limit = limits.get((metric.name, figure.subject), "none")
    return TextRow(figure.figure, figure.says, model, ours, limit, metric.differs or figure.note)


def _cell(metric: Metric, subject: str, ours: float | None, finding: Finding | None) -> Cell:
    assert metric.column is not None
    paper, digits = metric.paper.get(subject), metric.column.digits
    mark = MARK if metric.name in SPANS and subject not in FINGERS else ""
    return Cell(
        metric.column.title,
        _number(ours, digits),
        "" if paper is None else _number(paper, digits) + mark,
        "" if finding is None else finding.expected,
        finding is not None and not finding.passed,
    )


def _number(value: float | None, digits: int) -> str:
    """Return a number for a table; an en dash where it was withheld, `none` where it could not be measured."""
    if value is None:
        return "\u2013"
    return "none" if math.isnan(value) else f"{value:.{digits}f}"
