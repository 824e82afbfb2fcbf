"""What a terminal says about a run that failed: findings and causes, then where, why and what to do."""

from __future__ import annotations

from collections.abc import Iterator

from rich.text import Text

from hil.checks.shared.subjects import subject_words
from hil.report.first_seen import first_seen
from hil.verdict.judged_run import Validation
from hil.verdict.next_step import cause_words, on_hand
from hil.verdict.run_summary import header_of, summary_of

CAUSES = 3
"""That are told."""


def told(validation: Validation) -> Iterator[Text]:
    """Yield a line for each thing that is told; none for a run in which nothing failed."""
    summary, header = summary_of(validation), header_of(validation)
    for finding in summary.unexplained:
        yield _line("failed", f"{finding.sentence}. {finding.meaning} {finding.remedy}")
    if summary.likeliest:
        for finding in summary.explained:
            yield _line("failed", f"{finding.sentence} ({cause_words(summary.likeliest.cause)})")
    for cause in summary.causes[:CAUSES]:
        where = "hand" if cause.channel is None else subject_words(cause.channel.label)
        look = on_hand(cause.next_look, header) if header else cause.next_look
        share = f"{cause.probability:.0%} {cause_words(cause.cause)} ({where}): {cause.meaning} {look}"
        yield _line("perhaps", share)
    if summary.where:
        yield _line("where", summary.where)
    if since := first_seen(validation, summary.likeliest):
        yield _line("when", since.sentence)
    if summary.likeliest:
        yield _line("likely", f"{cause_words(summary.likeliest.cause)}, {summary.likeliest.probability:.0%}")
    elif summary.unlike:
        yield _line("likely", "none of the known causes: unlike every fault that was tried")
    if summary.step:
        yield _line("do this", summary.step.do)
        if summary.step.command:
            yield Text(f"        {summary.step.command}")


def _line(label: str, text: str) -> Text:
    return Text.assemble((f"{label:7}", "bold"), " ", text.replace("`", ""))
