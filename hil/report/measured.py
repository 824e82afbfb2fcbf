"""Measured values of a run with display names and units, for the page and as CSV."""

import csv
import io
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from hil.checks import metric_of
from hil.checks.shared.declaration import number
from hil.verdict.judged_run import Result

FORMAT = 1
"""Format version of `measured.csv`, increased when a column changes."""


@dataclass(frozen=True)
class MeasuredNumber:
    """Value of one metric on one subject."""

    experiment: str
    subject: str
    """Channel label, or another subject such as the whole hand."""
    metric: str
    """Name in `checks.json` and in the limits."""
    words: str
    value: float
    """Measured value; NaN if not measurable."""
    unit: str

    @property
    def number(self) -> str:
        """Value in full precision; empty if not measurable."""
        return "" if math.isnan(self.value) else repr(self.value)

    @property
    def text(self) -> str:
        """Value and unit for display."""
        return "not measurable" if math.isnan(self.value) else f"{number(self.value)} {self.unit}".strip()


def readings_of(name: str, result: Result) -> Iterator[MeasuredNumber]:
    """Yield the measured values of an experiment, subject by subject."""
    for subject, row in result.measured.items():
        for metric, value in row.items():
            meaning = metric_of(name, metric, subject)
            words = meaning.words if meaning else metric.replace("_", " ")
            yield MeasuredNumber(name, subject, metric, words, float(value), meaning.unit if meaning else "")


def measured_csv(judged: Mapping[str, Result]) -> str:
    """Return all measured values of a run as CSV, one a line, the value empty if not measurable."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(("experiment", "subject", "metric", "words", "value", "unit", "format"))
    for name, result in judged.items():
        for one in readings_of(name, result):
            lines.writerow((one.experiment, one.subject, one.metric, one.words, one.number, one.unit, FORMAT))
    return text.getvalue()
