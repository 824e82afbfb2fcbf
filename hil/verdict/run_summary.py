"""What a person is told first about a run: verdict, where, the likeliest explanation, and one thing to do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hil.checks import EXPERIMENTS
from hil.checks.shared.subjects import CHANNELS, subject_words
from hil.recordings.recording import Header
from hil.verdict.explained import explained_findings
from hil.verdict.explanation import Explanation, Place, Whereabouts
from hil.verdict.findings import Finding, failed
from hil.verdict.judged_run import Validation
from hil.verdict.next_step import NextStep, command_again, step_for
from hil.verdict.run_end import Way

PLACES = {
    Place.HOST_AND_DRIVER: "computer, driver or map",
    Place.LINK: "link between computer and board",
    Place.BOARD: "board and its firmware",
    Place.SUPPLY: "power supply",
}
"""The places that are no channel, for people."""
WHOLE_HAND = 4
"""Channels with failed checks from which on they are not counted one by one."""
SHARE = 0.01
"""Least probability that is told: below it stands 0 %."""
REPEATED = (Way.PERSON, Way.CUT)
"""Endings that say nothing about the hand."""


@dataclass(frozen=True)
class Summary:
    """What is told first."""

    where: str
    """The place, inside a sentence; empty when nothing failed."""
    likeliest: Explanation | None
    """None when nothing failed, when no known cause fits, and when a person broke it off."""
    causes: tuple[Explanation, ...]
    """Those that fit, with a share worth telling."""
    unlike: bool
    """Whether something is wrong that is unlike anything known."""
    step: NextStep | None
    """What to do; None when nothing failed."""
    explained: tuple[Finding, ...]
    """Failed findings that the likeliest cause accounts for."""
    unexplained: tuple[Finding, ...]
    """The others."""


def summary_of(validation: Validation) -> Summary:
    """Return what a person is told first about a run."""
    failures, header = failed(validation.findings), header_of(validation)
    diagnosis = validation.diagnosis
    causes = tuple(cause for cause in diagnosis.explanations if cause.probability >= SHARE)
    likeliest = causes[0] if causes else None
    explained = explained_findings(validation, likeliest) if likeliest else ()
    rest = tuple(finding for finding in failures if finding not in explained)
    # That a person or the end of a file ended it says nothing about a place.
    placed = tuple(f for f in failures if validation.end.way not in REPEATED or f != validation.end.finding)
    where = _where(diagnosis.where[0], failures) if diagnosis.where else _subjects(placed)
    step = _step(validation, likeliest, rest or failures, header) if failures and header else None
    return Summary(where, likeliest, causes, diagnosis.unlike_anything_known, step, explained, rest)


def header_of(validation: Validation) -> Header | None:
    """Return the header of the first recording of a run, None when nothing was recorded."""
    recordings = [*(result.recording for result in validation.results.values()), *validation.end.cut]
    recordings += [validation.whole_run.recording] if validation.whole_run else []
    return recordings[0].header if recordings else None


def _step(
    validation: Validation, likeliest: Explanation | None, findings: Sequence[Finding], header: Header
) -> NextStep:
    if validation.end.way in REPEATED:
        return NextStep("Run it again: it was not finished.", command_again(header))
    if likeliest is not None and (step := step_for(likeliest, header)) is not None:
        return step
    first = findings[0]
    asked = [name for name, result in validation.results.items() if first in result.findings and EXPERIMENTS[name].asks]
    command = command_again(header) if asked else ""
    return NextStep(f"Look at the {subject_words(first.subject)}. {first.remedy}", command)


def _where(found: Whereabouts, failures: Sequence[Finding]) -> str:
    if found.channel is not None:
        return subject_words(found.channel.label)
    return PLACES.get(found.place) or _subjects(failures)


def _subjects(failures: Sequence[Finding]) -> str:
    """Return the channels that failed, in words."""
    off = [subject_words(label) for label in CHANNELS if any(finding.subject == label for finding in failures)]
    if not failures:
        return ""
    if not off or len(off) >= WHOLE_HAND:
        return "whole hand"
    return off[0] if len(off) == 1 else f"{', '.join(off[:-1])} and {off[-1]}"
