"""One self-contained HTML page about one run of experiments: verdict first, then why, then everything it rests on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal
from urllib.parse import quote

import markupsafe
from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup

from aero.channels import Channel
from hil.checks import EXPERIMENTS, WHOLE_RUN
from hil.checks.shared.experiment import Details
from hil.checks.shared.subjects import CHANNELS, SUBJECTS, subject_words
from hil.recordings.wire_file import with_series
from hil.report.beside_paper import compared, notes, table, text_rows
from hil.report.evidence import Evidence, by_finding, first_seen
from hil.report.figures import Drawn, figures_of, traces_of
from hil.report.hand_picture import MARKS, WORDS, DigitState, outline, thumb_heights, verdicts
from hil.report.plots import Mark
from hil.verdict.findings import Finding, failed
from hil.verdict.judged_run import Result, Validation
from hil.verdict.margins import margins_left

BYTES_ALONE = (
    "These are the bytes of a program and a hand, without an experiment: the link is judged. What was meant is not in "
    "them, so the driver's order, scale and sign are not judged."
)
"""Of a recording that `emulate` or `proxy` made."""
RunVerdict = Literal["pass", "fail", "broken"]


@dataclass(frozen=True)
class Section:
    """One experiment of the page."""

    name: str
    title: str
    result: Result
    failed: int
    figures: list[Drawn]
    opened: bool
    """Whether it is unfolded: what stands beside the paper always, the others when something failed."""
    legend: bool
    """Whether its figures have the lines of the paper's figure."""
    details: Details | None


@dataclass(frozen=True)
class Shown:
    """One failed finding of the page."""

    anchor: str
    finding: Finding
    evidence: Evidence | None
    target: str
    """What the link to its figure points at; empty when nothing shows it."""
    experiment: str
    """Whose recording holds it; empty when it is about the run."""


def render_report(validation: Validation, files: Mapping[str, str] | None = None) -> str:
    """Return the page for a run of experiments; it loads nothing from anywhere.

    Args:
        validation: the run.
        files: name of an experiment, or `session`, to the path of its recording, relative to the page; without one
            the page does not link to it.

    Raises:
        ValueError: nothing was recorded, so there is nothing to report on.
    """
    recordings = [*(result.recording for result in validation.results.values()), *validation.end.cut]
    bytes_alone = not recordings and validation.whole_run is not None
    if bytes_alone and validation.whole_run is not None:
        recordings = [validation.whole_run.recording]
    if not recordings:
        raise ValueError("no experiment began; there is nothing to report on")
    seen = by_finding(validation.judged)
    sections = _sections(validation, seen)
    shown = _shown(validation, seen, sections)
    header = recordings[0].header
    diagnosis = validation.diagnosis
    spoken = [indication.finding for indication in diagnosis.evidence]
    finished = validation.end.finding is None
    return _template().render(
        header=header,
        validation=validation,
        verdict=_verdict(validation),
        outline=outline(header.hand),
        channels=verdicts(validation.findings, finished=finished),
        thumb_heights=thumb_heights(header.hand),
        marks=MARKS,
        words=WORDS,
        states=_states(validation, finished=finished),
        first_finding={item.finding.subject: item.anchor for item in reversed(shown)},
        shown=shown,
        diagnosis=diagnosis,
        since=first_seen(validation),
        explained=[item for item in shown if item.finding in spoken],
        unexplained=[item for item in shown if item.finding not in spoken],
        sections=sections,
        beside=_beside_paper(validation),
        text_rows=text_rows(validation),
        bytes_alone=BYTES_ALONE if bytes_alone else "",
        exchanged=traces_of(with_series(recordings[0])) if bytes_alone else [],
        broken_off=[(recording.header, traces_of(recording)) for recording in validation.end.cut],
        events=[(recording.header.experiment, event) for recording in recordings for event in recording.events],
        files={name: quote(path) for name, path in (files or {}).items()},
        margins=margins_left(result.recording for result in validation.results.values()),
        session=WHOLE_RUN.name,
        subjects=SUBJECTS,
    )


@cache
def _template() -> Template:
    environment = Environment(
        loader=PackageLoader("hil.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"marked": marked, "subject": subject_words, "number": number}
    return environment.get_template("report.html.j2")


def number(value: float) -> str:
    """Return a reading in four digits, in words where it could not be measured."""
    return "not measurable" if math.isnan(value) else f"{value:.4g}"


def marked(text: str) -> Markup:
    """Return a text as HTML, with what stands between backticks as code."""
    parts = text.split("`")
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if i % 2 else markupsafe.escape(part) for i, part in enumerate(parts)
    )


def _verdict(validation: Validation) -> RunVerdict:
    if validation.end.cut:
        return "broken"
    return "pass" if validation.passed else "fail"


def _states(validation: Validation, *, finished: bool) -> list[DigitState]:
    """Return the verdicts that the picture of this run has, for its legend."""
    found = {verdict.state for verdict in verdicts(validation.findings, finished=finished).values()}
    return [state for state in WORDS if state in found]


def _sections(validation: Validation, seen: Mapping[Finding, Evidence]) -> list[Section]:
    found = []
    for name, result in validation.results.items():
        bad = failed(result.findings)
        figures = figures_of(name, result.recording, _marks(bad, seen)) if result.measured else []
        experiment = EXPERIMENTS[name]
        opened = bool(bad) or bool(experiment.columns)
        details = experiment.details(result.recording) if experiment.details and result.measured else None
        legend = "sweeps" in experiment.drawn and bool(figures)
        found.append(Section(name, experiment.title, result, len(bad), figures, opened, legend, details))
    return found


def _marks(findings: Iterable[Finding], seen: Mapping[Finding, Evidence]) -> list[tuple[str, Mark]]:
    """Return what to mark in which figure: what shows a finding about one channel."""
    return [
        (seen[finding].figure, Mark(Channel(CHANNELS.index(finding.subject)), seen[finding].start, seen[finding].end))
        for finding in findings
        if finding in seen and finding.subject in CHANNELS
    ]


def _shown(validation: Validation, seen: Mapping[Finding, Evidence], sections: Iterable[Section]) -> list[Shown]:
    """Return the failed findings, each with where it can be seen: its figure, else its experiment."""
    figures = {figure.name for section in sections for figure in section.figures}
    owner = {finding: name for name, result in validation.judged.items() for finding in failed(result.findings)}

    def shown(number: int, finding: Finding) -> Shown:
        where, name = seen.get(finding), owner.get(finding, "")
        target = "" if where is None else where.figure if where.figure in figures else f"run-{name}"
        return Shown(f"finding-{number}", finding, where, target, name)

    return [shown(number, finding) for number, finding in enumerate(failed(validation.findings), start=1)]


def _beside_paper(validation: Validation) -> dict[str, Any] | None:
    """Return the table beside the paper's and why the two differ, None when nothing of it was measured."""
    result = compared(validation)
    if result is None:
        return None
    rows = table(result)
    return {"rows": rows, "notes": (found := notes(rows)), "number": {note.reason: note.number for note in found}}
