"""Comparison of measured values with the paper's, with limits and reasons for differences."""

import math
from dataclasses import dataclass
from importlib import resources

from aero.channels import Channel
from aero_hil_toml import filled, parsed
from hil.checks import EXPERIMENTS
from hil.checks.shared.declaration import Metric, Published
from hil.checks.shared.experiment import reading
from hil.checks.shared.subjects import FINGERS
from hil.recordings.series_layout import LENGTH_UNITS
from hil.verdict.findings import Finding
from hil.verdict.judged_run import Result, Validation

EXCURSION = EXPERIMENTS["excursion"]
MARK = "\u2020"
"""Footnote mark of a published value of another quantity."""
MARKED = (
    f"{MARK} Another quantity: the thumb is swept alone through its whole window here, and goes to a fist in the paper."
)


@dataclass(frozen=True)
class Cell:
    """Measured value beside the paper's, both as text."""

    name: str
    ours: str
    paper: str
    """Published value; with `MARK` if it is a different quantity."""
    limit: str
    failed: bool = False


@dataclass(frozen=True)
class PaperRow:
    """Row of the table, one a channel."""

    title: str
    unit: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class TextRow:
    """Value from the text of the paper beside ours."""

    name: str
    paper: str
    model: str
    ours: str
    limit: str
    note: str


def compared(validation: Validation) -> Result | None:
    """Return the result to be compared with the paper's table, or None if none was measured."""
    return next(
        (result for name, result in validation.results.items() if result.measured and EXPERIMENTS[name].columns), None
    )


def table(result: Result) -> tuple[PaperRow, ...]:
    """Return the table of an experiment's declared columns, a row a channel, with the paper's values and limits."""
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
    """Return the known differences from the paper: pairs of column and reason, to the affected channels."""
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
    """Return the values from the paper's text: those measured, then those that cannot be measured."""
    measured = [
        _text_row(figure, metric, name, validation)
        for name, measuring in EXPERIMENTS.items()
        if validation.measured(name) is not None
        for metric in measuring.metrics
        for figure in metric.published
    ]
    text = (resources.files("hil.checks") / "unmeasured.toml").read_text(encoding="utf-8")
    unmeasured = filled(tuple[Published, ...], parsed(text, "unmeasured.toml")["figure"], "unmeasured.toml")
    return measured + [TextRow(row.figure, row.says, "", "not measured", "", row.note) for row in unmeasured]


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
    mark = MARK if metric.column.swept and subject not in FINGERS else ""
    return Cell(
        metric.column.title,
        _number(ours, digits),
        "" if paper is None else _number(paper, digits) + mark,
        "" if finding is None else finding.expected,
        finding is not None and not finding.passed,
    )


def _number(value: float | None, digits: int) -> str:
    """Return a value for a table: an en dash if withheld, `none` if not measurable."""
    if value is None:
        return "\u2013"
    return "none" if math.isnan(value) else f"{value:.{digits}f}"
