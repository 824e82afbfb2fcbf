"""A run as text for a terminal, in the order of the page; numbers are never cut."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from rich.table import Table
from rich.text import Text

from hil.checks import JUDGED
from hil.report.evidence import excess, first_seen
from hil.report.page import HEADINGS, MOST_FINDINGS, verdict_of, withheld_lines
from hil.verdict.findings import Finding, failed
from hil.verdict.judged_run import Validation


def result_line(name: str, findings: Sequence[Finding]) -> Text:
    """Return the line of one experiment: how many of its checks failed, or how many passed."""
    bad = len(failed(findings))
    count = (f"{bad} of {len(findings)} failed", "bold") if bad else f"{len(findings)} checks passed"
    return Text.assemble(f"{name:10} {JUDGED[name].title}: ", count)


def run_text(validation: Validation, report: str, *, shown: Collection[str] = ()) -> Iterator[Text | Table]:
    """Yield what a person reads about a run: verdict, what the evidence says, other findings, then each experiment.

    The experiments of `shown` are left out: their lines were printed when they ended.
    """
    if not validation.passed:
        heading = _heading(validation)
        yield Text(f"{heading[0].upper()}{heading[1:]}", style="bold")
    lines = Table.grid(padding=(0, 1), pad_edge=False)
    for label, text in _lines(validation):
        lines.add_row(Text(label, style="bold"), Text(text.replace("`", "")))
    if lines.rows:
        yield lines
    for name, result in validation.judged.items():
        if name in shown or (not result.findings and name not in validation.results):
            continue
        yield result_line(name, result.findings)
    seconds = f"{validation.hand_seconds:.0f} s of hand time in {validation.wall_seconds:.1f} s"
    yield Text(f"{_heading(validation)}; {validation.tally.words}; {seconds}; {report}")


def _heading(validation: Validation) -> str:
    heading, place = HEADINGS[verdict_of(validation)][2:].lower(), validation.diagnosis.place
    return f"{heading}: {place}" if place else heading


def _lines(validation: Validation) -> Iterator[tuple[str, str]]:
    """Yield what the evidence says and the other findings, each line with its label."""
    diagnosis, end = validation.diagnosis, validation.end.finding
    if end is not None:
        remedy = "" if diagnosis.step and diagnosis.step.do == end.remedy else f" {end.remedy}"
        yield "ended", f"{end.sentence}. {end.meaning}{remedy}"
    if since := first_seen(validation):
        yield "when", since
    if diagnosis.sentence:
        yield "what", diagnosis.sentence
    for observed in diagnosis.observations:
        yield "observed", f"{observed}."
    if diagnosis.step:
        yield "do this", diagnosis.step.do
        if diagnosis.step.command:
            yield "", diagnosis.step.command
    speaking = sorted((finding for finding in diagnosis.evidence if finding != end), key=excess, reverse=True)
    others = [finding for finding in failed(validation.findings) if finding not in (*speaking, end)]
    yield from _findings("evidence", speaking, remedy=not diagnosis.step)
    yield from _findings("other" if speaking else "failed", others, remedy=True)
    for reason, lines in withheld_lines(validation).items():
        yield "grey", f"not judged: {'; '.join(lines)}: {reason}"
    if validation.remark:
        yield "left out", validation.remark


def _findings(label: str, findings: Sequence[Finding], *, remedy: bool) -> Iterator[tuple[str, str]]:
    for finding in findings[:MOST_FINDINGS]:
        yield label, f"{finding.sentence}. {finding.meaning}{f' {finding.remedy}' if remedy else ''}"
    if len(findings) > MOST_FINDINGS:
        yield label, f"{len(findings) - MOST_FINDINGS} more, see the report"
