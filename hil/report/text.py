"""Summary of a run for a terminal, at most one screen long."""

from collections.abc import Iterator, Sequence

from rich.text import Text

from hil.checks import JUDGED
from hil.report.page import HEADINGS, verdict_of
from hil.verdict.findings import Finding, failed
from hil.verdict.judged_run import Validation
from hil.verdict.parts import listed
from hil.verdict.sentences import channel_sentences

MOST_LINES = 3
"""Limit of failing channels or parts listed on a terminal."""


def result_line(name: str, findings: Sequence[Finding]) -> Text:
    """Return the line of one experiment with the number of failed or passed checks."""
    bad = len(failed(findings))
    count = (f"{bad} of {len(findings)} failed", "bold") if bad else f"{len(findings)} checks passed"
    return Text.assemble(f"{name:10} {JUDGED[name].title}: ", count)


def run_text(validation: Validation, report: str) -> Iterator[Text]:
    """Yield the verdict on a run; for a failed run also failing channels, suspects and the next step."""
    heading = HEADINGS[verdict_of(validation)][2:]
    seconds = f"{validation.hand_seconds:.0f} s of hand time in {validation.wall_seconds:.1f} s"
    if validation.passed:
        yield Text(f"{heading.lower()}; {validation.tally.words}; {seconds}; {report}")
        return
    yield Text(f"{heading}; {validation.tally.words}; {seconds}", style="bold")
    if (end := validation.end.finding) is not None:
        yield Text(f"{end.check[0].upper()}{end.check[1:]} {end.measured}: {end.meaning}")
    for line in failing_lines(validation):
        yield Text(line)
    diagnosis = validation.diagnosis
    if diagnosis.suspects:
        yield Text.assemble(
            ("Suspected: ", "bold"), f"{listed(map(str, diagnosis.suspects))}; no test has shown which."
        )
    if diagnosis.step:
        yield Text.assemble(("Next: ", "bold"), diagnosis.step.do.replace("`", ""))
        if diagnosis.step.command:
            yield Text(f"  {diagnosis.step.command}")
    if validation.remark:
        yield Text(validation.remark)
    yield Text.assemble(("Report: ", "bold"), report)


def failing_lines(validation: Validation) -> Iterator[str]:
    """Yield a sentence for each failing channel or part, at most `MOST_LINES`, then the number of omitted ones."""
    lines = channel_sentences(validation)
    yield from lines[:MOST_LINES]
    if (more := len(lines) - MOST_LINES) > 0:
        yield f"and {more} more"
