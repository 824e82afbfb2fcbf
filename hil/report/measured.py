"""Everything that a run measured, in words and with units: for the page and as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from hil.checks import JUDGED
from hil.checks.shared.declaration import number
from hil.verdict.judged_run import Result


@dataclass(frozen=True)
class MeasuredNumber:
    """One number that was measured."""

    experiment: str
    subject: str
    """A channel, or what else was measured."""
    metric: str
    """Name in `checks.json` and in the limits."""
    words: str
    """Name for people."""
    value: float
    """NaN where it could not be measured."""
    unit: str

    @property
    def number(self) -> str:
        """Value in full, empty where it could not be measured."""
        return "" if math.isnan(self.value) else repr(self.value)

    @property
    def text(self) -> str:
        """Value and unit for people."""
        return "not measurable" if math.isnan(self.value) else f"{number(self.value)} {self.unit}".strip()


def readings_of(name: str, result: Result) -> Iterator[MeasuredNumber]:
    """Yield what an experiment measured, subject by subject."""
    known = {(metric.name, subject): metric for metric in JUDGED[name].metrics for subject in metric.subjects}
    for subject, row in result.measured.items():
        for metric, value in row.items():
            meaning = known.get((metric, subject))
            words = meaning.words if meaning else metric.replace("_", " ")
            yield MeasuredNumber(name, subject, metric, words, float(value), meaning.unit if meaning else "")


def measured_csv(judged: Mapping[str, Result]) -> str:
    """Return every reading of a run, one a line; what could not be measured has no value."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(("experiment", "subject", "metric", "words", "value", "unit"))
    for name, result in judged.items():
        for one in readings_of(name, result):
            lines.writerow((one.experiment, one.subject, one.metric, one.words, one.number, one.unit))
    return text.getvalue()
