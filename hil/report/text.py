"""Summary of a run for a terminal, at most one screen long."""

from collections.abc import Iterator, Sequence
from textwrap import wrap

from rich.text import Text

from aero.printable import capital
from hil.checks import JUDGED
from hil.report.page import HEADINGS, MOST_SENTENCES, counts, verdict_of
from hil.verdict.findings import Finding, failed
from hil.verdict.judged_run import Validation
from hil.verdict.run_end import EndKind
from hil.verdict.sentences import channel_sentences

SCREEN, WIDTH = 21, 80
"""Lines and columns of a terminal that a failed run may fill, the lines of its experiments included."""


def result_line(name: str, findings: Sequence[Finding]) -> Text:
    """Return the line of one experiment.

    The number of failed checks is left to the verdict on the run, which withholds some of them.
    """
    passed = f"{len(findings)} checks passed" if findings else "not judged"
    outcome = ("failed", "bold") if failed(findings) else passed
    return Text.assemble(f"{name:10} {JUDGED[name].title}: ", outcome)


def run_text(validation: Validation, report: str) -> Iterator[Text]:
    """Yield the verdict on a run; for a failed run also failing channels, suspects and the next step.

    The reason of an error is left to the last line on standard error.
    """
    heading = HEADINGS[verdict_of(validation)][2:]
    seconds = f"{validation.hand_seconds:.0f} s of hand time in {validation.wall_seconds:.1f} s"
    if validation.passed:
        yield Text(f"{heading.lower()}; {validation.tally.words}; {seconds}; {report}")
        return
    head = [Text(f"{heading}; {counts(validation)}; {seconds}", style="bold")]
    if (end := validation.end.finding) is not None:
        on_stderr = validation.end.error is not None or validation.end.kind is EndKind.HOST_BUSY
        reason = "." if on_stderr else f": {end.meaning}"
        head.append(Text(f"{capital(end.check)} {end.measured}{reason}"))
    tail = [*_after_the_channels(validation), Text.assemble(("Report: ", "bold"), report)]
    printed = [*map(str, head), *map(str, tail), str(validation.end.error or "")]
    yield from head
    yield from map(Text, failing_lines(validation, SCREEN - len(validation.results) - sum(map(_height, printed))))
    yield from tail


def _after_the_channels(validation: Validation) -> Iterator[Text]:
    """Yield suspects, next step and remark."""
    diagnosis = validation.diagnosis
    if diagnosis.suspects:
        # a suspected channel has its sentence above
        suspected = Text(diagnosis.suspected if diagnosis.channels else diagnosis.sentence)
        suspected.highlight_words(["Suspected:"], "bold")
        yield suspected
    if diagnosis.step:
        yield Text.assemble(("Next: ", "bold"), diagnosis.step.do.replace("`", ""))
        if diagnosis.step.command:
            yield Text(f"  {diagnosis.step.command}")
    if validation.remark:
        yield Text(validation.remark)


def failing_lines(validation: Validation, room: int = SCREEN) -> Iterator[str]:
    """Yield a sentence for each failing channel or part, then the number of omitted ones.

    Args:
        validation: judged run.
        room: number of free lines on the screen; at least one sentence is yielded, and at most `MOST_SENTENCES`.
    """
    sentences = channel_sentences(validation)
    shown = min(len(sentences), MOST_SENTENCES)
    while shown > 1 and sum(map(_height, sentences[:shown])) + (shown < len(sentences)) > room:
        shown -= 1
    yield from sentences[:shown]
    if more := len(sentences) - shown:
        yield f"and {more} more"


def _height(text: str) -> int:
    """Return the number of lines of a text on a terminal."""
    return len(wrap(text, WIDTH))
